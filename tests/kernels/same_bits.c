/* The whole core on made-up numbers, and a hash of every bit that comes out.
 *
 * Compiled with the C files for any processor; equal output means equal bits. The numbers come
 * from a congruential generator, for sin and random differ between libraries.
 */
#include "batch.h"

#include <stdio.h>
#include <string.h>

enum { N = 400, TERMS = 40, CHANNELS = 2, ATOMS = HD_FIXED_ATOMS + 2 * CHANNELS, P = 12 };

static uint64_t seed = 42;

/* Between -size and size, by steps of 2^-16 of it. */
static hd_real any(hd_real size)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return size * ((hd_real)(int32_t)((seed >> 44) & 0x1ffff) / 65536 - 1);
}

static void report(const char *what, const hd_real *values, size_t count)
{
    uint64_t hash = UINT64_C(14695981039346656037); /* FNV-1a */

    for (size_t i = 0; i < count; ++i) {
        unsigned char each[sizeof(hd_real)];
        hd_real value = values[i] == values[i] ? values[i] : (hd_real)0; /* NaNs have many bits */
        memcpy(each, &value, sizeof value);
        for (size_t b = 0; b < sizeof each; ++b)
            hash = (hash ^ each[b]) * UINT64_C(1099511628211);
    }
    printf("%s %08x%08x\n", what, (unsigned)(hash >> 32), (unsigned)(hash & 0xffffffffu));
}

static int32_t factors[TERMS * 4], parameters[2 * P], starts[7], rows[TERMS];
static hd_real time[N], velocity[6 * N], down[3 * N], wrench[6 * N], channels[CHANNELS * N];
static hd_real slope[3 * N], propulsion[2 * N];
static hd_real attitude[4 * N], mass[36], gamma[6 * TERMS], known[6 * TERMS];
static hd_real matrix[6 * TERMS], moved[6 * N], jacobian[6 * N * (P + 6)], work[200000];
static hd_real coefficients[TERMS], information[6 * TERMS * TERMS], noise[6], count[6];
static hd_real iv[9 * TERMS * TERMS];
static hd_real unit[TERMS];

static void make(void)
{
    for (size_t i = 0; i < 6; ++i) {
        for (size_t k = 0; k <= i; ++k)
            mass[6 * i + k] = mass[6 * k + i] = any((hd_real)0.1);
        mass[7 * i] = 2 + any(1);
    }
    for (size_t j = 0; j < TERMS; ++j)
        for (size_t k = 0; k < 4; ++k)
            factors[4 * j + k] = k < 2 || j % 3 == 0 ? (int32_t)(j * (k + 3) + k) % ATOMS : 0;
    for (size_t j = 0; j < 6; ++j) { /* linear drag, so that a replay stays put */
        factors[4 * j] = (int32_t)j + 1;
        factors[4 * j + 1] = factors[4 * j + 2] = factors[4 * j + 3] = 0;
    }
    for (size_t i = 0; i < 6 * TERMS; ++i) {
        matrix[i] = i < 36 ? (i % 7 == 0 ? -1 : 0) : any((hd_real)0.002);
        gamma[i] = 20;
    }
    for (size_t k = 0; k < N; ++k) {
        time[k] = k ? time[k - 1] + (hd_real)0.1 + any((hd_real)0.01) : 0;
        for (size_t i = 0; i < 6; ++i) {
            velocity[6 * k + i] = (i ? 0 : 1) + any((hd_real)0.5);
            wrench[6 * k + i] = any((hd_real)0.5);
        }
        for (size_t i = 0; i < 3; ++i) {
            down[3 * k + i] = (i == 2) + any((hd_real)0.1);
            slope[3 * k + i] = any(1);
        }
        for (size_t i = 0; i < CHANNELS; ++i)
            channels[CHANNELS * k + i] = k % 3 ? channels[CHANNELS * (k - 1) + i] : any(1);
        propulsion[2 * k] = propulsion[2 * k + 1] = 1 + any((hd_real)0.2);
        attitude[4 * k] = 1;
        for (size_t i = 1; i < 4; ++i)
            attitude[4 * k + i] = any((hd_real)0.1);
    }
    for (size_t i = 0; i < P; ++i) {
        parameters[2 * i] = (int32_t)(3 * i);
        parameters[2 * i + 1] = (int32_t)(i % 6);
    }
    for (size_t j = 0; j < TERMS; ++j) {
        rows[j] = (int32_t)j;
        unit[j] = 1 + any((hd_real)0.5);
        starts[1] = (int32_t)j + 1; /* all on the first axis */
    }
    for (size_t i = 2; i < 7; ++i)
        starts[i] = starts[1];
}

int main(void)
{
    static const unsigned char free_axes[6] = {1, 1, 1, 1, 1, 1};
    static const hd_real a[6] = {20, 20, 20, 20, 20, 20};
    const int64_t segments[4] = {0, N / 2, N / 2, N};
    int64_t diverged[2];
    hd_real error[6];

    make();
    const hd_plant plant = {TERMS, CHANNELS, factors, mass, free_axes};
    const hd_record record = {N, CHANNELS, time, velocity, down, wrench, channels, propulsion};
    const hd_motion measured = {&plant, matrix, &record, slope, NULL, (hd_real)0.05, 50, NULL};
    const hd_motion simulated = {&plant, matrix, &record, slope, attitude, (hd_real)0.05, 50, NULL};
    const hd_history none = {0, NULL, NULL, NULL};
    const hd_entries entries = {starts, rows, known};
    const hd_estimate estimate = {unit,        (hd_real)0.02, coefficients,
                                  information, noise,         count, iv};

    hd_replay(&measured, segments, 2, parameters, P, 1, NULL, moved, jacobian, diverged, work);
    report("replay", moved, 6 * N);
    report("sensitivities", jacobian, 6 * N * (P + 6));
    hd_replay(&simulated, segments, 2, parameters, P, 1, NULL, moved, jacobian, diverged, work);
    report("replay, attitude simulated", moved, 6 * N);
    report("sensitivities, attitude simulated", jacobian, 6 * N * (P + 6));
    printf("diverged %d %d\n", (int)diverged[0], (int)diverged[1]);
    hd_recur_run(&plant, &entries, &estimate, 1, &record, segments, 2, work);
    report("recursive least squares", coefficients, TERMS);
    report("its information", information, TERMS * TERMS);
    report("its noise", noise, 6);
    hd_adapt_run(&plant, a, gamma, matrix, error, &record, segments, 2, 2, &none, work);
    report("adaptive identifier", matrix, 6 * TERMS);
    report("its error", error, 6);
    return 0;
}
