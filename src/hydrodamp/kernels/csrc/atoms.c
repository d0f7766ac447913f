/* Atoms: the symbols that terms are products of, and their derivatives. */
#include "onboard.h"

static const hd_real slowest = (hd_real)1e-6; /* m/s; guards the propulsion ratio */

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
    atoms[17 * stride] = propulsion_speed / (speed < slowest ? slowest : speed) - 1;
    for (size_t i = 0; i < 3; ++i)
        atoms[(18 + i) * stride] = down[i];
    for (size_t i = 0; i < n_channels; ++i) {
        atoms[(HD_FIXED_ATOMS + i) * stride] = channels[i];
        atoms[(HD_FIXED_ATOMS + n_channels + i) * stride] = hd_fabs(channels[i]);
    }
}

/* slope[axis][k] += factor * weight[axis] for all axes. */
static void add(const hd_real weight[6], hd_real factor, size_t k, hd_real slope[36])
{
    for (size_t i = 0; i < 6; ++i)
        slope[6 * i + k] += factor * weight[i];
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
        add(weights + 6 * (1 + k), 1, k, slope);
        add(weights + 6 * (7 + k), sign(velocity[k]), k, slope);
    }
    if (speed > 0) { /* dU = nu_1 / U; d(eta-1) = -u_c / U^2 dU */
        const hd_real ratio = speed > slowest ? -propulsion_speed / (speed * speed) : 0;
        for (size_t k = 0; k < 3; ++k) {
            add(weights + 6 * 13, velocity[k] / speed, k, slope);
            add(weights + 6 * 17, ratio * (velocity[k] / speed), k, slope);
        }
    }
    if (crossflow > 0) /* dV = (v, w) / V; V_v and V_w carry their sign */
        for (size_t k = 1; k < 3; ++k) {
            const hd_real d = velocity[k] / crossflow;
            add(weights + 6 * 14, d, k, slope);
            add(weights + 6 * 15, sign(v) * d, k, slope);
            add(weights + 6 * 16, sign(w) * d, k, slope);
        }
}
