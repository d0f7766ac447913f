/* hydrodamp at the desk: whole records at a time, with what a vehicle does not need. */
#ifndef HYDRODAMP_BATCH_H
#define HYDRODAMP_BATCH_H

#include "onboard.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A record of n samples, each array row-major. */
typedef struct {
    size_t n;
    size_t n_channels;
    const hd_real *time;
    const hd_real *velocity;
    const hd_real *down;
    const hd_real *wrench;
    const hd_real *channels;
    const hd_real *propulsion; /* n x 2: opening, closing */
} hd_record;

hd_sample hd_sample_at(const hd_record *record, size_t k);

/* out[i * row + j * column] = xi_j at sample i. Workspace: n_atoms * HD_BLOCK. */
void hd_regressor(const int32_t *factors, size_t n_terms, const hd_record *record,
                  const hd_real *propulsion_speed, hd_real *out, ptrdiff_t row,
                  ptrdiff_t column, hd_real *work);

/* motion.c ----------------------------------------------------------------- */
/* wrench[n][6] = H(M nu) nu of n velocities. */
void hd_coriolis_rows(const hd_real mass[36], const hd_real *velocity, size_t n, hd_real *wrench);

/* attitude.c --------------------------------------------------------------- */
/* Quaternions w x y z, body to world. */
void hd_down(const hd_real q[4], hd_real down[3]);               /* R(q)^T e3 */
void hd_down_slope(const hd_real q[4], hd_real slope[12]);       /* 3 x 4 */
void hd_quaternion_rate(const hd_real q[4], const hd_real omega[3], hd_real rate[4]);
void hd_quaternion_by_omega(const hd_real q[4], hd_real slope[12]);     /* 4 x 3 */
void hd_quaternion_by_itself(const hd_real omega[3], hd_real slope[16]); /* 4 x 4 */
hd_real hd_normalise(hd_real q[4]);                              /* returns |q| */

/* interval.c --------------------------------------------------------------- */
/* The inputs between two samples. */
typedef struct {
    hd_real length; /* s */
    size_t steps;   /* equal sub-steps */
    const hd_real *wrench[2];
    const hd_real *down[2];
    const hd_real *channels;
    hd_real propulsion_speed;
} hd_interval;

hd_interval hd_interval_after(const hd_record *record, size_t k, hd_real max_step);

/* out[i] = a[i] + fraction * (b[i] - a[i]). */
void hd_blend(const hd_real *a, const hd_real *b, hd_real fraction, size_t n, hd_real *out);

/* 1 if a velocity component is not finite or beyond the limit. */
int hd_diverged(const hd_real velocity[6], hd_real limit);

/* replay.c ----------------------------------------------------------------- */
/* Integrate every segment open loop by RK4 from its first recorded sample.
 * attitude: n x 4 or NULL. Outside the segments and after divergence velocity is NaN.
 * diverged_at[s]: first bad sample or -1. Workspace: n_atoms + n_terms. */
void hd_replay(const hd_plant *plant, const hd_real *matrix, const hd_record *record,
               const int64_t *segments, size_t n_segments, const hd_real *attitude,
               hd_real max_step, hd_real limit, hd_real *velocity, int64_t *diverged_at,
               hd_real *work);

/* sensitivity.c ------------------------------------------------------------ */
/* hd_replay and its derivative on p coefficients and the initial velocity:
 * jacobian[n][6][p + 6]. parameters: p x 2 rows (term, axis).
 * Workspace: hd_sensitivity_work numbers. */
size_t hd_sensitivity_work(size_t n_terms, size_t n_channels, size_t n_parameters);
void hd_sensitivities(const hd_plant *plant, const hd_real *matrix, const int32_t *parameters,
                      size_t n_parameters, const hd_record *record, const int64_t *segments,
                      size_t n_segments, const hd_real *attitude, hd_real max_step,
                      hd_real limit, hd_real *velocity, hd_real *jacobian, hd_real *work);

/* identifier.c, recursive.c */
/* The fold of hd_adapt_step over a record; error starts at 0 in every segment.
 * every > 0: the state after each every-th step goes to the history arrays. */
typedef struct {
    size_t every;
    hd_real *time;   /* k */
    hd_real *error;  /* k x 6 */
    hd_real *matrix; /* k x n_terms x 6 */
} hd_history;

void hd_adapt(const hd_plant *plant, const hd_real a[6], const hd_real *gamma, hd_real *matrix,
              hd_real error[6], const hd_record *record, const int64_t *segments,
              size_t n_segments, size_t passes, const hd_history *history, hd_real *work);

/* robust.c ----------------------------------------------------------------- */
/* The settings; leakage 0, dead zone 0 and infinite bounds change nothing. */
typedef struct {
    const hd_real *a;     /* 6 */
    const hd_real *gains; /* Gamma_i, n_i x n_i, positive definite, one behind the other */
    const hd_real *rest;  /* where leakage leads to, one a coefficient */
    const hd_real *lower; /* bounds, one a coefficient */
    const hd_real *upper;
    hd_real leakage;   /* 1/s */
    hd_real dead_zone; /* of sqrt(D'MD), sqrt(kg) m/s */
} hd_robust;

/* What moves: error starts at 0 in every segment, sum and duration where a mean starts. */
typedef struct {
    hd_real *coefficients; /* one an entry */
    hd_real *error;        /* 6 */
    hd_real *sum;          /* coefficients after each step times its length */
    hd_real *duration;     /* 1: of the steps summed, s */
} hd_adapting;

/* One implicit midpoint step with these settings. Workspace: hd_robust_work numbers. */
size_t hd_robust_work(const hd_entries *entries, size_t n_terms, size_t n_channels);
void hd_robust_step(const hd_plant *plant, const hd_entries *entries, const hd_robust *robust,
                    const hd_adapting *adapting, const hd_sample *previous,
                    const hd_sample *current, hd_real *work);

/* The fold over a record; the mean starts before step number `from`. every > 0: the state
 * after each every-th step goes to the history, whose matrix has a coefficient a column. */
void hd_robust_run(const hd_plant *plant, const hd_entries *entries, const hd_robust *robust,
                   const hd_adapting *adapting, size_t from, const hd_record *record,
                   const int64_t *segments, size_t n_segments, const hd_history *history,
                   hd_real *work);

/* Rows from blocks of a record, each taken in; no block spans two segments. every > 0: after
 * each every-th step time, noise (as error) and coefficients go to the history. */
size_t hd_recur_work(const hd_entries *entries, size_t n_terms, size_t n_channels);
void hd_recur(const hd_plant *plant, const hd_entries *entries, const hd_estimate *estimate,
              hd_real length, hd_real *block, const hd_record *record, const int64_t *segments,
              size_t n_segments, const hd_history *history, hd_real *work);

#ifdef __cplusplus
}
#endif
#endif
