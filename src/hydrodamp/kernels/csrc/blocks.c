/* Rows of a regression that needs no acceleration, from two neighbouring blocks of time.
 *
 * The steps M (nu_{k+1} - nu_k) = h (f + K xi) are weighted with a hat, which rises over the
 * first block and falls over the second, and summed: y_i = kappa_i . phi on each axis. A
 * hat's slope is a constant on each block, so what momentum is gained enters by its mean
 * over either block; single readings, and their noise, do not. The weight of a step is
 * the hat's at mid-step, so data that satisfy the steps satisfy the rows exactly, on
 * any clock.
 */
#include "onboard.h"

enum { ELAPSED, HAS_RISEN, HEAD };

size_t hd_block_size(size_t n_terms)
{
    return HEAD + 3 * (n_terms + 6);
}

static void gather(const hd_plant *plant, const hd_real *known, const hd_step *step,
                   hd_real *block)
{
    const size_t n = plant->n_terms;
    const hd_real h = step->length, at = block[ELAPSED] + h / 2;
    hd_real *sum = block + HEAD, *moment = sum + n + 6;
    hd_real gained[6], force[6] = {0};

    hd_momentum(plant->mass, step->change, gained);
    for (size_t j = 0; j < n; ++j)
        for (size_t i = 0; i < 6; ++i)
            force[i] += known[6 * j + i] * step->xi[j];
    for (size_t j = 0; j < n; ++j) {
        const hd_real part = h * step->xi[j];
        sum[j] += part;
        moment[j] += at * part;
    }
    for (size_t i = 0; i < 6; ++i) {
        const hd_real part = gained[i] - h * (step->forcing[i] + force[i]);
        sum[n + i] += part;
        moment[n + i] += at * part;
    }
    block[ELAPSED] += h;
}

/* Close the block and begin the next; 1 where one had been closed before. */
static int close(size_t n_terms, hd_real *block, hd_real *row)
{
    const size_t m = n_terms + 6;
    const hd_real length = block[ELAPSED];
    const int complete = block[HAS_RISEN] > 0;
    hd_real *sum = block + HEAD, *moment = sum + m, *risen = moment + m;

    for (size_t j = 0; j < m; ++j) {
        const hd_real rising = moment[j] / length;
        row[j] = risen[j] + (sum[j] - rising);
        risen[j] = rising;
        sum[j] = moment[j] = 0;
    }
    block[ELAPSED] = 0;
    block[HAS_RISEN] = 1;
    return complete;
}

int hd_block_add(const hd_plant *plant, const hd_real *known, const hd_step *step,
                 hd_real length, hd_real *block, hd_real *row)
{
    gather(plant, known, step, block);
    if (block[ELAPSED] + step->length / 2 < length) /* the whole number of steps nearest */
        return 0;
    return close(plant->n_terms, block, row);
}
