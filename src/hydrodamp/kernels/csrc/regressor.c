/* Terms at all samples of a record, in blocks that stay in cache. */
#include "batch.h"

/* One term at `count` samples; consecutive atoms are HD_BLOCK numbers apart. */
static void term_of_block(const int32_t *f, const hd_real *atoms, size_t count, hd_real *to)
{
    const hd_real *a = atoms + (size_t)f[0] * HD_BLOCK;
    const hd_real *b = atoms + (size_t)f[1] * HD_BLOCK;
    const hd_real *c = atoms + (size_t)f[2] * HD_BLOCK;
    const hd_real *d = atoms + (size_t)f[3] * HD_BLOCK;

    if (f[2] | f[3])
        for (size_t i = 0; i < count; ++i)
            to[i] = a[i] * b[i] * c[i] * d[i];
    else
        for (size_t i = 0; i < count; ++i)
            to[i] = a[i] * b[i];
}

void hd_regressor(const int32_t *factors, size_t n_terms, const hd_record *record,
                  const hd_real *propulsion_speed, hd_real *out, ptrdiff_t row,
                  ptrdiff_t column, hd_real *work)
{
    const size_t m = record->n_channels;
    hd_real values[HD_BLOCK];

    for (size_t start = 0; start < record->n; start += HD_BLOCK) {
        const size_t remaining = record->n - start;
        const size_t count = remaining < HD_BLOCK ? remaining : HD_BLOCK;
        for (size_t i = 0; i < count; ++i)
            hd_atoms(record->velocity + 6 * (start + i), record->down + 3 * (start + i),
                     record->channels + m * (start + i), m, propulsion_speed[start + i],
                     work + i, HD_BLOCK);
        for (size_t j = 0; j < n_terms; ++j) {
            hd_real *to = out + (ptrdiff_t)start * row + (ptrdiff_t)j * column;
            if (row == 1) {
                term_of_block(factors + 4 * j, work, count, to);
                continue;
            }
            term_of_block(factors + 4 * j, work, count, values);
            for (size_t i = 0; i < count; ++i)
                to[(ptrdiff_t)i * row] = values[i];
        }
    }
}

void hd_coriolis_rows(const hd_real mass[36], const hd_real *velocity, size_t n, hd_real *wrench)
{
    for (size_t k = 0; k < n; ++k)
        hd_coriolis(mass, velocity + 6 * k, wrench + 6 * k);
}
