/* Extended Kalman filter along a replay: pushes and coloured errors of the sensors.
 *
 * The states are z = (nu, d, n): the velocity, a push [N, N m] on each axis of the wrench (an
 * Ornstein-Uhlenbeck process), and the error of each measured velocity, of first order:
 *
 *   nu+ = phi(nu, kappa) + B d,   d+ = exp(-h/tau) d + w,   n+ = a^(h/step) n + e,   y = nu + n
 *
 * with B = (1 + A) M^-1 h / 2 and A = d phi / d nu from the replay. The derivative D of z on the
 * coefficients and on the first velocity follows the same recursion with B and the gains K held:
 * D <- D + K de, de = -(D_nu + D_n). Innovations and derivatives are over the Cholesky factor of
 * the innovation covariance.
 */
#include "batch.h"

enum { STATES = 18 };

static const hd_real white_share = (hd_real)1e-4; /* of the variance of an error: keeps S regular */

/* out[6][m] = a[6][6] b[6][m] */
static inline void premultiply(const hd_real *restrict a, const hd_real *restrict b, size_t m,
                               hd_real *restrict out)
{
    for (size_t i = 0; i < 6; ++i) {
        for (size_t j = 0; j < m; ++j)
            out[m * i + j] = a[6 * i] * b[j];
        for (size_t k = 1; k < 6; ++k)
            for (size_t j = 0; j < m; ++j)
                out[m * i + j] += a[6 * i + k] * b[m * k + j];
    }
}

size_t hd_filter_work(size_t n_parameters)
{
    return STATES * STATES + 12 + 12 * (n_parameters + 6);
}

void hd_filter_start(const hd_filter *filter)
{
    const hd_noise *noise = filter->noise;
    const size_t n = hd_filter_work(filter->n_parameters);

    for (size_t i = 0; i < n; ++i)
        filter->state[i] = 0;
    for (size_t i = 0; i < 6; ++i) {
        filter->state[(STATES + 1) * (6 + i)] = noise->push[i] * noise->push[i];
        filter->state[(STATES + 1) * (12 + i)] = noise->sensor[i] * noise->sensor[i];
    }
}

/* Lower Cholesky factor of a, in place; its diagonal becomes the reciprocals of the pivots. */
static void factorise(hd_real a[36])
{
    for (size_t j = 0; j < 6; ++j) {
        for (size_t k = 0; k < j; ++k)
            a[7 * j] -= a[6 * j + k] * a[6 * j + k];
        a[7 * j] = 1 / hd_sqrt(a[7 * j]);
        for (size_t i = j + 1; i < 6; ++i) {
            for (size_t k = 0; k < j; ++k)
                a[6 * i + j] -= a[6 * i + k] * a[6 * j + k];
            a[6 * i + j] *= a[7 * j];
        }
    }
}

/* x[6][m] <- C^-1 x, in place, with the factor C of factorise */
static inline void whiten(const hd_real factor[36], hd_real *x, size_t m)
{
    for (size_t i = 0; i < 6; ++i) {
        for (size_t k = 0; k < i; ++k)
            for (size_t c = 0; c < m; ++c)
                x[m * i + c] -= factor[6 * i + k] * x[m * k + c];
        for (size_t c = 0; c < m; ++c)
            x[m * i + c] *= factor[7 * i];
    }
}

void hd_filter_update(const hd_filter *filter, const unsigned char *free_axes, size_t k,
                      hd_real *velocity, hd_real *rows, hd_real *innovation, hd_real *slope)
{
    hd_real *covariance = filter->state, *noise = covariance + STATES * STATES;
    hd_real *noise_rows = noise + 12, factor[36], gain[6 * STATES], cross[6 * STATES];
    hd_real correction[6];
    const hd_real *measured = filter->measured + 6 * k;
    const size_t width = filter->n_parameters + 6;

    for (size_t i = 0; i < 6; ++i) /* cross: H P, its rows those of the outputs */
        for (size_t j = 0; j < STATES; ++j)
            cross[STATES * i + j] = covariance[STATES * i + j] + covariance[STATES * (12 + i) + j];
    for (size_t i = 0; i < 6; ++i) {
        for (size_t j = 0; j < 6; ++j)
            factor[6 * i + j] = cross[STATES * i + j] + cross[STATES * i + 12 + j];
        factor[7 * i] += white_share * filter->noise->sensor[i] * filter->noise->sensor[i];
        innovation[i] = free_axes[i] ? measured[i] - velocity[i] - noise[6 + i] : 0;
    }
    factorise(factor);
    for (size_t i = 0; i < 6; ++i)
        filter->log_std[6 * k + i] = -hd_log(factor[7 * i]);
    whiten(factor, innovation, 1);
    for (size_t i = 0; i < 6 * STATES; ++i)
        gain[i] = cross[i];
    whiten(factor, gain, STATES); /* C^-1 H P: its product with itself is what P loses */
    for (size_t i = 0; i < STATES; ++i)
        for (size_t l = 0; l < 6; ++l)
            for (size_t j = 0; j < STATES; ++j)
                covariance[STATES * i + j] -= gain[STATES * l + i] * gain[STATES * l + j];
    for (size_t i = 0; i < STATES; ++i) {
        hd_real sum = 0;
        for (size_t l = 0; l < 6; ++l)
            sum += gain[STATES * l + i] * innovation[l];
        if (i < 6)
            velocity[i] += sum;
        else
            noise[i - 6] += sum;
    }
    for (size_t c = 0; c < width; ++c) {
        hd_real *row = rows + 6 * c, *noise_row = noise_rows + 12 * c;
        for (size_t i = 0; i < 6; ++i)
            correction[i] = row[i] + noise_row[6 + i];
        whiten(factor, correction, 1);
        for (size_t i = 0; i < 6; ++i)
            slope[width * i + c] = correction[i];
        for (size_t j = 0; j < 6; ++j) {
            for (size_t i = 0; i < 6; ++i)
                row[i] -= gain[STATES * j + i] * correction[j];
            for (size_t i = 0; i < 12; ++i)
                noise_row[i] -= gain[STATES * j + 6 + i] * correction[j];
        }
    }
}

void hd_filter_predict(const hd_filter *filter, const hd_real transition[36], const hd_real inverse[36],
                       hd_real length, hd_real *velocity, hd_real *rows)
{
    const hd_noise *model = filter->noise;
    hd_real *covariance = filter->state, *noise = covariance + STATES * STATES;
    hd_real *noise_rows = noise + 12, by_push[36], top[6 * STATES], pushed[6 * STATES];
    hd_real decay[12], variance[12];
    const size_t width = filter->n_parameters + 6;

    premultiply(transition, inverse, 6, by_push);
    for (size_t i = 0; i < 36; ++i)
        by_push[i] = length / 2 * (by_push[i] + inverse[i]);
    for (size_t i = 0; i < 6; ++i) {
        decay[i] = hd_exp(-length / model->time_constant);
        decay[6 + i] = hd_pow(model->correlation[i], length / model->step);
        variance[i] = model->push[i] * model->push[i] * (1 - decay[i] * decay[i]);
        variance[6 + i] = model->sensor[i] * model->sensor[i] * (1 - decay[6 + i] * decay[6 + i]);
    }
    premultiply(transition, covariance, STATES, top);
    premultiply(by_push, covariance + 6 * STATES, STATES, pushed);
    for (size_t i = 0; i < 6 * STATES; ++i)
        top[i] += pushed[i]; /* the first rows of F P */
    for (size_t i = 0; i < 6; ++i)
        for (size_t j = 0; j < 6; ++j) {
            hd_real sum = 0;
            for (size_t k = 0; k < 6; ++k)
                sum += top[STATES * i + k] * transition[6 * j + k]
                       + top[STATES * i + 6 + k] * by_push[6 * j + k];
            covariance[STATES * i + j] = sum;
        }
    for (size_t i = 0; i < 6; ++i)
        for (size_t j = 6; j < STATES; ++j) {
            covariance[STATES * i + j] = top[STATES * i + j] * decay[j - 6];
            covariance[STATES * j + i] = covariance[STATES * i + j];
        }
    for (size_t i = 6; i < STATES; ++i) {
        for (size_t j = 6; j < STATES; ++j)
            covariance[STATES * i + j] *= decay[i - 6] * decay[j - 6];
        covariance[(STATES + 1) * i] += variance[i - 6];
    }
    for (size_t i = 0; i < 6; ++i)
        for (size_t k = 0; k < 6; ++k)
            velocity[i] += by_push[6 * i + k] * noise[k];
    for (size_t i = 0; i < 12; ++i)
        noise[i] *= decay[i];
    for (size_t c = 0; c < width; ++c) { /* the replay has propagated the velocity's rows */
        hd_real *row = rows + 6 * c, *noise_row = noise_rows + 12 * c;
        for (size_t i = 0; i < 6; ++i)
            for (size_t k = 0; k < 6; ++k)
                row[i] += by_push[6 * i + k] * noise_row[k];
        for (size_t i = 0; i < 12; ++i)
            noise_row[i] *= decay[i];
    }
}
