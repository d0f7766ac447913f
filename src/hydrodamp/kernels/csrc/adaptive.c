/* The adaptive identifier of eqs. 15-16 by the implicit midpoint rule.
 *
 * With d the error at mid-step, xi the mean of the terms at both samples and
 * f the mean of H(M nu) nu + wrench, one step of length h solves
 *
 *   (2M/h + diag(a_i + h/2 sum_j gamma_ij xi_j^2)) d
 *       = 2M D_k/h + f + K_k xi - M (nu_{k+1} - nu_k)/h
 *   K_{k+1} = K_k - h gamma o (d xi^T),    D_{k+1} = 2d - D_k.
 *
 * It is stable at every h, and V = 1/2 D'MD + 1/2 sum (K - K_true)_ij^2/gamma_ij
 * changes by exactly -h d'diag(a)d + h d.eps: the proof of eq. 23 in discrete time.
 */
#include "onboard.h"

/* force = K xi and stiffness_i = sum_j gamma_ij xi_j^2 in one sweep */
static void damping_and_stiffness(const hd_real *matrix, const hd_real *gamma, const hd_real *xi,
                                  size_t n_terms, hd_real force[6], hd_real stiffness[6])
{
    hd_real k[6] = {0}, s[6] = {0};

    for (size_t j = 0; j < n_terms; ++j) {
        const hd_real x = xi[j], square = x * x;
        for (size_t i = 0; i < 6; ++i) {
            k[i] += matrix[6 * j + i] * x;
            s[i] += gamma[6 * j + i] * square;
        }
    }
    for (size_t i = 0; i < 6; ++i) {
        force[i] = k[i];
        stiffness[i] = s[i];
    }
}

/* K -= h gamma o (xi d'); each row is read before it is written */
static void update_matrix(hd_real *matrix, const hd_real *gamma, const hd_real *xi, size_t n_terms,
                 hd_real h, const hd_real d[6])
{
    for (size_t j = 0; j < n_terms; ++j) {
        const hd_real step_xi = h * xi[j];
        hd_real row[6];
        for (size_t i = 0; i < 6; ++i)
            row[i] = matrix[6 * j + i] - gamma[6 * j + i] * (step_xi * d[i]);
        for (size_t i = 0; i < 6; ++i)
            matrix[6 * j + i] = row[i];
    }
}

/* Replace rows and columns of locked axes by those of the identity matrix. */
static void lock(const unsigned char free_axes[6], hd_real lhs[36], hd_real rhs[6])
{
    for (size_t i = 0; i < 6; ++i) {
        if (free_axes[i])
            continue;
        for (size_t k = 0; k < 6; ++k)
            lhs[6 * i + k] = lhs[6 * k + i] = 0;
        lhs[7 * i] = 1;
        rhs[i] = 0;
    }
}

void hd_error_step(const hd_plant *plant, const hd_real a[6], const hd_real force[6],
                   const hd_real stiffness[6], hd_real error[6], const hd_step *step, hd_real d[6])
{
    const hd_real half = (hd_real)0.5, h = step->length;
    hd_real rate[6], momentum[6], lhs[36];

    for (size_t i = 0; i < 6; ++i) /* 2M D/h - M (nu_{k+1} - nu_k)/h, one product */
        rate[i] = (2 * error[i] - step->change[i]) / h;
    hd_momentum(plant->mass, rate, momentum);
    for (size_t i = 0; i < 36; ++i)
        lhs[i] = 2 / h * plant->mass[i];
    for (size_t i = 0; i < 6; ++i) {
        lhs[7 * i] += a[i] + half * h * stiffness[i];
        d[i] = momentum[i] + step->forcing[i] + force[i];
    }
    lock(plant->free_axes, lhs, d);
    hd_cholesky_six(lhs, d);
    for (size_t i = 0; i < 6; ++i)
        error[i] = 2 * d[i] - error[i];
}

void hd_adapt(const hd_plant *plant, const hd_real a[6], const hd_real *gamma, hd_real *matrix,
              hd_real error[6], const hd_step *step)
{
    hd_real force[6], stiffness[6], d[6];

    damping_and_stiffness(matrix, gamma, step->xi, plant->n_terms, force, stiffness);
    hd_error_step(plant, a, force, stiffness, error, step, d);
    update_matrix(matrix, gamma, step->xi, plant->n_terms, step->length, d);
}
