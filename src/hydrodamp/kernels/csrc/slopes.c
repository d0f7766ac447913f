/* Derivatives of atoms, of damping and of the moving frame on the velocity. */
#include "batch.h"

static const hd_real min_speed = (hd_real)1e-6; /* m/s; guards the propulsion ratio */

static hd_real sign(hd_real x) { return (hd_real)((x > 0) - (x < 0)); }

/* to += factor * from, six axes */
static inline void add_row(hd_real factor, const hd_real *from, hd_real *to)
{
    hd_real row[6];

    for (size_t i = 0; i < 6; ++i)
        row[i] = to[i] + factor * from[i];
    for (size_t i = 0; i < 6; ++i)
        to[i] = row[i];
}

void hd_atom_slopes(const hd_real velocity[6], hd_real propulsion_speed, const hd_real *weights,
                    hd_real slope[36])
{
    const hd_real u = velocity[0], v = velocity[1], w = velocity[2];
    const hd_real speed = hd_sqrt(u * u + v * v + w * w);
    const hd_real crossflow = hd_sqrt(v * v + w * w);

    for (size_t i = 0; i < 36; ++i)
        slope[i] = 0;
    for (size_t k = 0; k < 6; ++k) { /* d nu = 1, d |nu| = sign(nu), 0 at the kink */
        add_row(1, weights + 6 * (1 + k), slope + 6 * k);
        add_row(sign(velocity[k]), weights + 6 * (7 + k), slope + 6 * k);
    }
    if (speed > 0) { /* dU = nu_1 / U; d(eta-1) = -u_c / U^2 dU */
        const hd_real ratio = speed > min_speed ? -propulsion_speed / (speed * speed) : 0;
        for (size_t k = 0; k < 3; ++k) {
            add_row(velocity[k] / speed, weights + 6 * 13, slope + 6 * k);
            add_row(ratio * (velocity[k] / speed), weights + 6 * 17, slope + 6 * k);
        }
    }
    if (crossflow > 0) /* dV = (v, w) / V; V_v and V_w carry their sign */
        for (size_t k = 1; k < 3; ++k) {
            const hd_real d = velocity[k] / crossflow;
            add_row(d, weights + 6 * 14, slope + 6 * k);
            add_row(sign(v) * d, weights + 6 * 15, slope + 6 * k);
            add_row(sign(w) * d, weights + 6 * 16, slope + 6 * k);
        }
}

void hd_atom_weights(const int32_t *factors, size_t n_terms, const hd_real *atoms,
                     size_t n_atoms, const hd_real *matrix, hd_real *weights)
{
    for (size_t i = 0; i < 6 * n_atoms; ++i)
        weights[i] = 0;
    for (size_t j = 0; j < n_terms; ++j) {
        const int32_t *f = factors + 4 * j;
        const hd_real a = atoms[f[0]], b = atoms[f[1]], c = atoms[f[2]], d = atoms[f[3]];
        add_row(b * c * d, matrix + 6 * j, weights + 6 * f[0]);
        add_row(a * c * d, matrix + 6 * j, weights + 6 * f[1]);
        if (f[2] | f[3]) { /* what falls to atom 0, the constant one, is never read */
            add_row(a * b * d, matrix + 6 * j, weights + 6 * f[2]);
            add_row(a * b * c, matrix + 6 * j, weights + 6 * f[3]);
        }
    }
}

void hd_coriolis_slope(const hd_real mass[36], const hd_real velocity[6], hd_real slope[36])
{
    hd_real p[6];

    hd_momentum(mass, velocity, p);
    for (size_t k = 0; k < 6; ++k) { /* H(M e_k) nu + H(M nu) e_k */
        hd_real unit[6] = {0};
        unit[k] = 1;
        for (size_t i = 0; i < 6; ++i)
            slope[6 * k + i] = 0;
        hd_add_moving_frame(mass + 6 * k, velocity, slope + 6 * k);
        hd_add_moving_frame(p, unit, slope + 6 * k);
    }
}
