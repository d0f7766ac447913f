/* Offline use: whole records, derivatives, and single steps on packed samples. */
#ifndef HYDRODAMP_BATCH_H
#define HYDRODAMP_BATCH_H

#include "onboard.h"

#ifdef HD_FLOAT
#define hd_log logf
#define hd_exp expf
#else
#define hd_log log
#define hd_exp exp
#endif

#ifdef __cplusplus
extern "C" {
#endif

enum { HD_BLOCK = 64 }; /* samples whose terms are evaluated together */

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

/* regressor.c -------------------------------------------------------------- */
/* out[i * row + j * column] = xi_j at sample i. Workspace: n_atoms * HD_BLOCK. */
void hd_regressor(const int32_t *factors, size_t n_terms, const hd_record *record,
                  const hd_real *propulsion_speed, hd_real *out, ptrdiff_t row,
                  ptrdiff_t column, hd_real *work);

/* wrench[n][6] = H(M nu) nu of n velocities. */
void hd_coriolis_rows(const hd_real mass[36], const hd_real *velocity, size_t n, hd_real *wrench);

/* slopes.c ----------------------------------------------------------------- */
/* weights[atom][axis] = d (K xi) / d atom, by the product rule. */
void hd_atom_weights(const int32_t *factors, size_t n_terms, const hd_real *atoms,
                     size_t n_atoms, const hd_real *matrix, hd_real *weights);

/* slope[velocity][axis] = sum over atoms of weights[atom][axis] * d atom / d velocity. */
void hd_atom_slopes(const hd_real velocity[6], hd_real propulsion_speed, const hd_real *weights,
                    hd_real slope[36]);

/* slope[velocity][axis] = d H(M nu) nu / d nu, linear in nu. */
void hd_coriolis_slope(const hd_real mass[36], const hd_real velocity[6], hd_real slope[36]);

/* attitude.c --------------------------------------------------------------- */
/* Quaternions w x y z, body to world. */
void hd_down(const hd_real q[4], hd_real down[3]);               /* R(q)^T e3 */
void hd_down_slope(const hd_real q[4], hd_real slope[12]);       /* 3 x 4 */
void hd_quaternion_rate(const hd_real q[4], const hd_real omega[3], hd_real rate[4]);
void hd_quaternion_by_omega(const hd_real q[4], hd_real slope[12]);      /* 4 x 3 */
void hd_quaternion_by_itself(const hd_real omega[3], hd_real slope[16]); /* 4 x 4 */
hd_real hd_normalise(hd_real q[4]);                              /* returns |q| */

/* filter.c ----------------------------------------------------------------- */
/* Pushes on the vehicle and errors of its measured velocities. */
typedef struct {
    const hd_real *push;        /* 6, standard deviations, N and N m */
    const hd_real *sensor;      /* 6, standard deviations; positive */
    const hd_real *correlation; /* 6, of errors one step apart */
    hd_real time_constant;      /* s, of the pushes */
    hd_real step;               /* s, of the correlations */
} hd_noise;

/* The filter at one sample: covariance 18 x 18, pushes 6 and errors 6, their derivatives. */
typedef struct {
    const hd_noise *noise;
    const hd_real *measured; /* n x 6 */
    hd_real *log_std;        /* n x 6: of the innovations */
    size_t n_parameters;
    hd_real *state;          /* hd_filter_work numbers */
} hd_filter;

size_t hd_filter_work(size_t n_parameters);
void hd_filter_start(const hd_filter *filter);

/* Correct velocity[6] and its rows[p + 6][6] by sample k; slope[6][p + 6] is the derivative of
 * the predicted output over the Cholesky factor of the innovations. */
void hd_filter_update(const hd_filter *filter, const unsigned char *free_axes, size_t k,
                      hd_real *velocity, hd_real *rows, hd_real *innovation, hd_real *slope);

/* Predict over a step, velocity and rows being propagated without pushes. */
void hd_filter_predict(const hd_filter *filter, const hd_real transition[36],
                       const hd_real inverse[36], hd_real length, hd_real *velocity,
                       hd_real *rows);

/* replay.c ----------------------------------------------------------------- */
/* Derivatives of the plant and its inputs on n parameters. */
typedef struct {
    size_t n;
    size_t n_known;          /* terms, the first ones, whose coefficients depend on them */
    const hd_real *mass;     /* n x 6 x 6 */
    const hd_real *matrix;   /* n x n_known x 6 */
    const hd_real *wrench;   /* n x samples x 6 */
    const hd_real *channels; /* n x samples x n_channels */
} hd_plant_slopes;

/* The equation of motion and its inputs. Between two samples the wrench is interpolated linearly
 * and down by the cubic with the given slopes at both; channels and propulsion speed are held. */
typedef struct {
    const hd_plant *plant;
    const hd_real *matrix;
    const hd_record *record;
    const hd_real *down_slope; /* n x 3, 1/s */
    const hd_real *attitude; /* n x 4, or NULL where the recorded down is to be used */
    hd_real max_step;        /* s; no sub-step is longer */
    hd_real limit;           /* of a velocity component; beyond it a segment has diverged */
    const hd_plant_slopes *slopes; /* on further parameters, or NULL */
} hd_motion;

/* Integrate every segment open loop by RK4 from its first recorded sample. Outside the
 * segments and after divergence velocity is NaN. diverged_at[s]: first bad sample or -1.
 * parameters: rows (term, axis) of the coefficients among p parameters; those of the slopes
 * follow. Where jacobian is not NULL it becomes the derivative
 * on them and on the initial velocity, a row [6][p + 6] for every block of samples of a segment,
 * segment by segment: their sum over the root of their number (block 1: every sample's own);
 * NaN after divergence. Workspace: hd_replay_work numbers; p is 0 without a jacobian.
 * With a filter each sample corrects the state: velocity becomes the innovations and jacobian the
 * slopes of the predicted outputs, as in filter.c. It needs block 1, no attitude, and a jacobian,
 * with which the transitions are made (p may be 0). */
size_t hd_replay_work(const hd_plant *plant, size_t n_parameters);
void hd_replay(const hd_motion *motion, const int64_t *segments, size_t n_segments,
               const int32_t *parameters, size_t n_parameters, size_t block,
               const hd_filter *filter, hd_real *velocity, hd_real *jacobian,
               int64_t *diverged_at, hd_real *work);

/* runs.c ------------------------------------------------------------------- */
/* hd_adapt over a record; the velocity error starts at 0 in every segment.
 * every > 0: the state after each every-th step goes to the history. */
typedef struct {
    size_t every;
    hd_real *time;   /* k */
    hd_real *error;  /* k x 6 */
    hd_real *matrix; /* k x n_terms x 6 */
} hd_history;

/* Workspace: hd_step_work numbers. */
void hd_adapt_run(const hd_plant *plant, const hd_real a[6], const hd_real *gamma,
                  hd_real *matrix, hd_real error[6], const hd_record *record,
                  const int64_t *segments, size_t n_segments, size_t passes,
                  const hd_history *history, hd_real *work);

/* Recursive least squares over a record; no block spans two segments. */
size_t hd_recur_work(const hd_entries *entries, size_t n_terms, size_t n_channels);
void hd_recur_run(const hd_plant *plant, const hd_entries *entries, const hd_estimate *estimate,
                  hd_real length, const hd_record *record, const int64_t *segments,
                  size_t n_segments, hd_real *work);

/* The composite adaptive identifier over a record. */
void hd_composite_run(const hd_plant *plant, const hd_entries *entries, const hd_composite *law,
                      hd_real *state, const hd_record *record, const int64_t *segments,
                      size_t n_segments, hd_real *work);

/* One step of the adaptive identifier or, where `known` is not NULL, of a block of time. */
typedef struct {
    const hd_plant *plant;
    const hd_real *a, *gamma; /* of hd_adapt */
    const hd_real *known;     /* as in hd_entries */
    hd_real length;           /* s, of the blocks */
    const hd_entries *entries;
    const hd_composite *law;  /* of the composite identifier, or NULL */
} hd_online;

/* The state is the matrix, then the error; the block; or that of the law. Packed samples begin with their time.
 * 0 where it does not advance, 2 where a row is complete. Workspace: hd_step_work numbers, and
 * behind them n_terms + 6 for the row. */
int hd_online_step(const hd_online *online, const hd_real *previous, const hd_real *current,
                   hd_real *state, hd_real *work);

#ifdef __cplusplus
}
#endif
#endif
