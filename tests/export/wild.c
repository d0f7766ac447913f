#include "auv_vt690_identifier.h"
#include <stdio.h>

static uint32_t seed = 33;

static double uniform(void)
{
    seed = seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return seed / 4294967296.0;
}

/* An ordinary number, or in a row of every so many one of any magnitude. */
static hd_real number(double usual, int is_wild)
{
    const double most = sizeof(hd_real) == 4 ? 38 : 308;
    const double sign = uniform() < 0.5 ? -1 : 1;
    return (hd_real)(sign * (is_wild ? pow(10, most * uniform()) : usual * uniform()));
}

#define TRY(way, WAY)                                                                          \
    {                                                                                          \
        static hd_real state[WAY##_STATE];                                                     \
        static hd_real was[auv_vt690_COEFFICIENTS], is[auv_vt690_COEFFICIENTS];                \
        long refused = 0, moved = 0, broken = 0, infinite = 0;                                 \
        auv_vt690_##way##_init(state, auv_vt690_exported);                                     \
        for (long k = 0; k < 100000; ++k) {                                                    \
            const int part = uniform() < 0.05 ? (int)(4 * uniform()) : -1;                     \
            hd_real v[6], down[3] = {0, 0, 1}, inputs[auv_vt690_INPUTS], other[6];             \
            for (int i = 0; i < 6; ++i) {                                                      \
                v[i] = number(i < 3 ? 2 : 0.3, part == 0 && uniform() < 0.3);                  \
                other[i] = number(1, part == 1 && uniform() < 0.3);                            \
            }                                                                                  \
            for (int i = 0; i < auv_vt690_INPUTS; ++i)                                         \
                inputs[i] = number(i ? 2000 : 0.3, part == 2);                                 \
            const hd_real h = part == 3 ? number(1, 1) : (hd_real)0.1;                         \
            auv_vt690_##way##_estimate(state, was);                                            \
            const int answer = auv_vt690_##way##_step(state, h, v, down, inputs, other);       \
            auv_vt690_##way##_estimate(state, is);                                             \
            refused += answer == 0;                                                            \
            moved += answer == 2;                                                              \
            for (int i = 0; answer == 0 && i < auv_vt690_COEFFICIENTS; ++i)                    \
                broken += !(was[i] == is[i]);                                                  \
            for (int i = 0; i < WAY##_LASTING; ++i)                                            \
                infinite += !(state[i] - state[i] == 0);                                       \
        }                                                                                      \
        printf("%d %d %ld %ld ", refused > 1000, moved > 0, broken, infinite);                 \
    }

int main(void)
{
    TRY(ai_composite, auv_vt690_AI_COMPOSITE)
    TRY(rls, auv_vt690_RLS)
    TRY(ai, auv_vt690_AI)
    return 0;
}
