#include "auv_vt690_identifier.h"
#include <stdio.h>
#include <string.h>

static const hd_real down[3] = {0, 0, 1}, inputs[3] = {(hd_real)0.1, 0, 2000}, none[6] = {0};

#define SAIL(way, state, from, to)                                                        \
    for (int k = from; k < to; ++k) {                                                     \
        const hd_real v[6] = {1 + (hd_real)(k % 7) / 8, (hd_real)(k % 5) / 9, 0, 0, 0, 0}; \
        (void)auv_vt690_##way##_step(state, (hd_real)0.1, v, down, inputs, none);             \
    }
#define TRY(way, WAY)                                                     \
    {                                                                     \
        static hd_real whole[WAY##_STATE], resumed[WAY##_STATE];          \
        static unsigned char kept[WAY##_KEPT];                            \
        auv_vt690_##way##_init(whole, auv_vt690_exported);                        \
        SAIL(way, whole, 0, 55)                                           \
        auv_vt690_##way##_get(whole, kept);                                   \
        SAIL(way, whole, 55, 200)                                         \
        const int taken = auv_vt690_##way##_set(resumed, kept);               \
        SAIL(way, resumed, 55, 200)                                       \
        const int same = !memcmp(whole, resumed, sizeof whole);           \
        kept[99] ^= 1;                                                    \
        const int damaged = auv_vt690_##way##_set(resumed, kept);             \
        kept[99] ^= 1;                                                    \
        const int foreign = hd_restore(kept, WAY##_LASTING, 1, resumed);    \
        const int stayed = !memcmp(whole, resumed, sizeof whole);         \
        printf("%d%d%d%d%d ", taken, same, damaged, foreign, stayed);     \
    }

int main(void)
{
    TRY(ai_composite, auv_vt690_AI_COMPOSITE)
    TRY(rls, auv_vt690_RLS)
    TRY(ai, auv_vt690_AI)
    return 0;
}
