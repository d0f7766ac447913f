/* Atoms, and terms as their products: one table for every model (eq. 4). */
#include "onboard.h"

static const hd_real min_speed = (hd_real)1e-6; /* m/s; guards the propulsion ratio */

static hd_real sign(hd_real x) { return (hd_real)((x > 0) - (x < 0)); }

size_t hd_atom_count(size_t n_channels) { return HD_FIXED_ATOMS + 2 * n_channels; }

void hd_atoms(const hd_real velocity[6], const hd_real down[3], const hd_real *channels,
              size_t n_channels, hd_real propulsion_speed, hd_real *atoms, size_t stride)
{
    const hd_real u = velocity[0], v = velocity[1], w = velocity[2];
    const hd_real speed = hd_sqrt(u * u + v * v + w * w); /* U */
    const hd_real crossflow = hd_sqrt(v * v + w * w);     /* V */

    atoms[0] = 1;
    for (size_t i = 0; i < 6; ++i) {
        atoms[(1 + i) * stride] = velocity[i];
        atoms[(7 + i) * stride] = hd_fabs(velocity[i]);
    }
    atoms[13 * stride] = speed;
    atoms[14 * stride] = crossflow;
    atoms[15 * stride] = sign(v) * crossflow;
    atoms[16 * stride] = sign(w) * crossflow;
    atoms[17 * stride] = propulsion_speed / (speed < min_speed ? min_speed : speed) - 1;
    for (size_t i = 0; i < 3; ++i)
        atoms[(18 + i) * stride] = down[i];
    for (size_t i = 0; i < n_channels; ++i) {
        atoms[(HD_FIXED_ATOMS + i) * stride] = channels[i];
        atoms[(HD_FIXED_ATOMS + n_channels + i) * stride] = hd_fabs(channels[i]);
    }
}

static inline hd_real term(const int32_t f[4], const hd_real *atoms)
{
    const hd_real product = atoms[f[0]] * atoms[f[1]];

    return f[2] | f[3] /* most terms have two factors; atom 0 is 1 */
               ? product * atoms[f[2]] * atoms[f[3]]
               : product;
}

void hd_terms(const int32_t *factors, size_t n_terms, const hd_real *atoms, hd_real *xi)
{
    for (size_t j = 0; j < n_terms; ++j)
        xi[j] = term(factors + 4 * j, atoms);
}

void hd_damping(const int32_t *factors, size_t n_terms, const hd_real *atoms,
                const hd_real *matrix, hd_real *xi, hd_real force[6])
{
    hd_real even[6] = {0}, odd[6] = {0}; /* two chains of sums, in a fixed order */
    size_t j = 0;

    for (; j + 1 < n_terms; j += 2) {
        const hd_real x = xi[j] = term(factors + 4 * j, atoms);
        const hd_real y = xi[j + 1] = term(factors + 4 * (j + 1), atoms);
        for (size_t i = 0; i < 6; ++i) {
            even[i] += matrix[6 * j + i] * x;
            odd[i] += matrix[6 * j + 6 + i] * y;
        }
    }
    if (j < n_terms) {
        xi[j] = term(factors + 4 * j, atoms);
        for (size_t i = 0; i < 6; ++i)
            even[i] += matrix[6 * j + i] * xi[j];
    }
    for (size_t i = 0; i < 6; ++i)
        force[i] = even[i] + odd[i];
}
