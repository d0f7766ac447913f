/* The right-hand side of eq. 1: momentum, damping, known wrenches. */
#include "onboard.h"

void hd_momentum(const hd_real mass[36], const hd_real velocity[6], hd_real product[6])
{
    for (size_t i = 0; i < 6; ++i)
        product[i] = mass[i] * velocity[0];
    for (size_t k = 1; k < 6; ++k)
        for (size_t i = 0; i < 6; ++i)
            product[i] += mass[6 * k + i] * velocity[k];
}

/* out += a x b */
static void add_cross(const hd_real a[3], const hd_real b[3], hd_real out[3])
{
    out[0] += a[1] * b[2] - a[2] * b[1];
    out[1] += a[2] * b[0] - a[0] * b[2];
    out[2] += a[0] * b[1] - a[1] * b[0];
}

void hd_add_moving_frame(const hd_real momentum[6], const hd_real velocity[6], hd_real out[6])
{
    add_cross(momentum, velocity + 3, out);
    add_cross(momentum, velocity, out + 3);
    add_cross(momentum + 3, velocity + 3, out + 3);
}

void hd_coriolis(const hd_real mass[36], const hd_real velocity[6], hd_real wrench[6])
{
    hd_real p[6];

    hd_momentum(mass, velocity, p);
    for (size_t i = 0; i < 6; ++i)
        wrench[i] = 0;
    hd_add_moving_frame(p, velocity, wrench);
}

void hd_mass_inverse(const hd_plant *plant, hd_real inverse[36])
{
    for (size_t k = 0; k < 6; ++k) {
        hd_real mass[36], column[6] = {0};
        for (size_t i = 0; i < 6; ++i)
            for (size_t j = 0; j < 6; ++j)
                mass[6 * i + j] = plant->free_axes[i] && plant->free_axes[j]
                                      ? plant->mass[6 * i + j]
                                      : (hd_real)(i == j);
        column[k] = plant->free_axes[k] ? 1 : 0;
        hd_cholesky_six(mass, column);
        for (size_t i = 0; i < 6; ++i)
            inverse[6 * k + i] = column[i];
    }
}

void hd_acceleration(const hd_plant *plant, const hd_real inverse[36], const hd_real *matrix,
                     const hd_real velocity[6], const hd_real down[3], const hd_real wrench[6],
                     const hd_real *channels, hd_real propulsion_speed, hd_real rate[6],
                     hd_real *atoms, hd_real *xi)
{
    hd_real force[6], gyroscopic[6];

    hd_atoms(velocity, down, channels, plant->n_channels, propulsion_speed, atoms, 1);
    hd_damping(plant->factors, plant->n_terms, atoms, matrix, xi, force);
    hd_coriolis(plant->mass, velocity, gyroscopic);
    for (size_t i = 0; i < 6; ++i)
        force[i] = gyroscopic[i] + force[i] + wrench[i];
    hd_momentum(inverse, force, rate); /* a symmetric 6 x 6 product, as M nu is */
}
