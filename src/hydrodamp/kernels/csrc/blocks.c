/* Rows of a regression that needs no acceleration, from two neighbouring blocks of time.
 *
 * The steps M (nu_{k+1} - nu_k) = h (f + K xi) are weighted with a hat, which rises over the
 * first block and falls over the second, and summed: y_i = kappa_i . phi on each axis. The
 * hat has a constant slope on each block, so momentum enters through its mean over either block
 * and the noise of single samples averages out. The weight of a step is
 * the hat's at mid-step, so data that satisfy the steps satisfy the rows exactly, on
 * any clock.
 */
#include "onboard.h"

enum { ELAPSED, HAS_RISING_SUM, HEAD };

size_t hd_block_size(size_t n_terms)
{
    return HEAD + 3 * (n_terms + 6);
}

static void accumulate(const hd_plant *plant, const hd_real *known, const hd_step *step,
                   hd_real *block)
{
    const size_t n = plant->n_terms;
    const hd_real h = step->length, midpoint = block[ELAPSED] + h / 2;
    hd_real *sum = block + HEAD, *moment = sum + n + 6;
    hd_real momentum[6], force[6] = {0};

    hd_momentum(plant->mass, step->change, momentum);
    for (size_t j = 0; j < n; ++j)
        for (size_t i = 0; i < 6; ++i)
            force[i] += known[6 * j + i] * step->xi[j];
    for (size_t j = 0; j < n; ++j) {
        const hd_real value = h * step->xi[j];
        sum[j] += value;
        moment[j] += midpoint * value;
    }
    for (size_t i = 0; i < 6; ++i) {
        const hd_real value = momentum[i] - h * (step->forcing[i] + force[i]);
        sum[n + i] += value;
        moment[n + i] += midpoint * value;
    }
    block[ELAPSED] += h;
}

/* Finish the block and begin the next; 1 where a block before it completes a row. */
static int finish_block(size_t n_terms, hd_real *block, hd_real *row)
{
    const size_t m = n_terms + 6;
    const hd_real length = block[ELAPSED];
    const int complete = block[HAS_RISING_SUM] > 0;
    hd_real *sum = block + HEAD, *moment = sum + m, *rising_sum = moment + m;

    for (size_t j = 0; j < m; ++j) {
        const hd_real rising = moment[j] / length;
        row[j] = rising_sum[j] + (sum[j] - rising);
        rising_sum[j] = rising;
        sum[j] = moment[j] = 0;
    }
    block[ELAPSED] = 0;
    block[HAS_RISING_SUM] = 1;
    return complete;
}

int hd_block_add(const hd_plant *plant, const hd_real *known, const hd_step *step,
                 hd_real length, hd_real *block, hd_real *row)
{
    accumulate(plant, known, step, block);
    if (block[ELAPSED] + step->length / 2 < length) /* the whole number of steps nearest */
        return 0;
    return finish_block(plant->n_terms, block, row);
}
