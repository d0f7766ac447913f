/* Terms: products of atoms, one table for every model (eq. 4). */
#include "batch.h"

static inline hd_real term(const int32_t f[HD_FACTORS], const hd_real *atoms)
{
    const hd_real product = atoms[f[0]] * atoms[f[1]];

    return f[2] | f[3] /* most terms have two factors; atom 0 is 1 */
               ? product * atoms[f[2]] * atoms[f[3]]
               : product;
}

void hd_terms(const int32_t *factors, size_t n_terms, const hd_real *atoms, hd_real *xi)
{
    for (size_t j = 0; j < n_terms; ++j)
        xi[j] = term(factors + HD_FACTORS * j, atoms);
}

void hd_damping(const int32_t *factors, size_t n_terms, const hd_real *atoms,
                const hd_real *matrix, hd_real *xi, hd_real force[6])
{
    hd_real even[6] = {0}, odd[6] = {0}; /* two chains of sums, in a fixed order */
    size_t j = 0;

    for (; j + 1 < n_terms; j += 2) {
        const hd_real x = xi[j] = term(factors + HD_FACTORS * j, atoms);
        const hd_real y = xi[j + 1] = term(factors + HD_FACTORS * (j + 1), atoms);
        for (size_t i = 0; i < 6; ++i) {
            even[i] += matrix[6 * j + i] * x;
            odd[i] += matrix[6 * j + 6 + i] * y;
        }
    }
    if (j < n_terms) {
        xi[j] = term(factors + HD_FACTORS * j, atoms);
        for (size_t i = 0; i < 6; ++i)
            even[i] += matrix[6 * j + i] * xi[j];
    }
    for (size_t i = 0; i < 6; ++i)
        force[i] = even[i] + odd[i];
}

/* to += factor * from, six axes */
static inline void add_row(hd_real factor, const hd_real *from, hd_real *to)
{
    hd_real row[6];

    for (size_t i = 0; i < 6; ++i)
        row[i] = to[i] + factor * from[i];
    for (size_t i = 0; i < 6; ++i)
        to[i] = row[i];
}

void hd_atom_weights(const int32_t *factors, size_t n_terms, const hd_real *atoms,
                     size_t n_atoms, const hd_real *matrix, hd_real *weights)
{
    for (size_t i = 0; i < 6 * n_atoms; ++i)
        weights[i] = 0;
    for (size_t j = 0; j < n_terms; ++j) {
        const int32_t *f = factors + HD_FACTORS * j;
        const hd_real a = atoms[f[0]], b = atoms[f[1]], c = atoms[f[2]], d = atoms[f[3]];
        add_row(b * c * d, matrix + 6 * j, weights + 6 * f[0]);
        add_row(a * c * d, matrix + 6 * j, weights + 6 * f[1]);
        if (f[2] | f[3]) { /* what falls to atom 0, the constant one, is never read */
            add_row(a * b * d, matrix + 6 * j, weights + 6 * f[2]);
            add_row(a * b * c, matrix + 6 * j, weights + 6 * f[3]);
        }
    }
}

/* One term at `count` samples; atoms lie HD_BLOCK apart. */
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
        const size_t left = record->n - start;
        const size_t count = left < HD_BLOCK ? left : HD_BLOCK;
        for (size_t i = 0; i < count; ++i)
            hd_atoms(record->velocity + 6 * (start + i), record->down + 3 * (start + i),
                     record->channels + m * (start + i), m, propulsion_speed[start + i],
                     work + i, HD_BLOCK);
        for (size_t j = 0; j < n_terms; ++j) {
            hd_real *to = out + (ptrdiff_t)start * row + (ptrdiff_t)j * column;
            if (row == 1) {
                term_of_block(factors + HD_FACTORS * j, work, count, to);
                continue;
            }
            term_of_block(factors + HD_FACTORS * j, work, count, values);
            for (size_t i = 0; i < count; ++i)
                to[(ptrdiff_t)i * row] = values[i];
        }
    }
}
