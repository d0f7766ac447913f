/* The adaptive identifier called from C: read a problem, time hd_adapt_run, print the error.
 *
 * The file holds the numbers of samples and of terms (int64), the factors (int32), then
 * doubles: mass by columns, a, gamma, start, time, velocity, down, wrench, propulsion.
 * Printed: the median CPU time [s] of some runs, and the last velocity error.
 */
#include "batch.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { RUNS = 3 };

static void *take(FILE *file, size_t size, size_t count)
{
    void *array = malloc(size * count + 1);

    if (!array || fread(array, size, count, file) != count) {
        fputs("the problem file is too short\n", stderr);
        exit(1);
    }
    return array;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

int main(int count, char **words)
{
    FILE *file = count == 2 ? fopen(words[1], "rb") : NULL;
    if (!file)
        return 2;
    const int64_t *sizes = take(file, sizeof(int64_t), 2);
    const size_t n = (size_t)sizes[0], m = (size_t)sizes[1];
    const unsigned char free_axes[6] = {1, 1, 1, 1, 1, 1};
    const int32_t *factors = take(file, sizeof(int32_t), 4 * m);
    const double *mass = take(file, sizeof(double), 36), *a = take(file, sizeof(double), 6);
    const double *gamma = take(file, sizeof(double), 6 * m);
    const double *start = take(file, sizeof(double), 6 * m);
    const double *time = take(file, sizeof(double), n);
    const double *velocity = take(file, sizeof(double), 6 * n);
    const double *down = take(file, sizeof(double), 3 * n);
    const double *wrench = take(file, sizeof(double), 6 * n);
    const double *propulsion = take(file, sizeof(double), 2 * n);
    const hd_plant plant = {m, 0, factors, mass, free_axes};
    const hd_record record = {n, 0, time, velocity, down, wrench, NULL, propulsion};
    const hd_history none = {0, NULL, NULL, NULL};
    const int64_t segment[2] = {0, sizes[0]};
    double *matrix = malloc(6 * m * sizeof(double));
    double *work = malloc(hd_step_work(m, 0) * sizeof(double));
    double error[6], seconds[RUNS];

    if (!matrix || !work)
        return 1;
    for (int run = 0; run < RUNS; ++run) {
        memcpy(matrix, start, 6 * m * sizeof(double));
        const clock_t before = clock();
        hd_adapt_run(&plant, a, gamma, matrix, error, &record, segment, 1, 1, &none, work);
        seconds[run] = (double)(clock() - before) / CLOCKS_PER_SEC;
    }
    qsort(seconds, RUNS, sizeof(double), ascending);
    printf("%.9g", seconds[RUNS / 2]);
    for (int i = 0; i < 6; ++i)
        printf(" %.17g", error[i]);
    return 0;
}
