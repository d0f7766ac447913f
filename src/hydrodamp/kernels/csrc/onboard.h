/* hydrodamp on board: equation 1 of a marine vehicle and its recursive estimators, in C99.
 *
 *   M dnu/dt = H(M nu) nu + K xi(nu) + wrench                        (eq. 1)
 *
 * No allocation, no input or output, no state between calls: the caller owns
 * every array, workspaces included. Numbers are hd_real: double, or float with
 * -DHD_FLOAT. Sums run in a fixed order; build with -ffp-contract=off and never
 * with -ffast-math, and every machine gives the same bits.
 *
 * Frames: body x forward, y starboard, z down; wrenches X Y Z [N], K M N [N m]
 * are on the right-hand side. Matrices are row-major, except the mass matrix, which is
 * column-major. A coefficient matrix has shape (n_terms, 6): the transpose of K.
 *
 * A term is a product of four atoms, given by their numbers (0 where unused):
 *   0        1                       17       (eta-1) = u_c / max(U, 1e-6) - 1
 *   1..6     u v w p q r             18..20   down vector in the body frame
 *   7..12    |u| |v| |w| |p| |q| |r| 21..     the m channels
 *   13       U   = |(u, v, w)|       21+m..   the m channels' absolute values
 *   14       V   = |(v, w)|
 *   15, 16   V_v = sign(v) V, V_w = sign(w) V
 */
#ifndef HYDRODAMP_ONBOARD_H
#define HYDRODAMP_ONBOARD_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#ifdef HD_FLOAT
#define HD_REAL float
#define hd_sqrt sqrtf
#define hd_fabs fabsf
#define hd_ceil ceilf
#define hd_pow powf
#else
#define HD_REAL double
#define hd_sqrt sqrt
#define hd_fabs fabs
#define hd_ceil ceil
#define hd_pow pow
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef HD_REAL hd_real;

enum {
    HD_FIXED_ATOMS = 21,
    HD_PACKED = 18,     /* numbers of a packed sample before its channels */
    HD_IV_LAGS = 4,     /* rows; lags of the products of innovations */
    HD_IV_PRODUCTS = 5, /* offset of these products in the state of an axis, behind the count */
    HD_IV_ESTIMATE = 9  /* offset of the instrumental-variable estimate */
};

/* The vehicle and its terms. */
typedef struct {
    size_t n_terms;
    size_t n_channels;
    const int32_t *factors;         /* n_terms x 4 atoms */
    const hd_real *mass;            /* 6 x 6, rigid body plus added mass, by columns */
    const unsigned char *free_axes; /* 6; 0 where an axis is locked */
} hd_plant;

/* One sample of what was measured. */
typedef struct {
    hd_real length;          /* s, of the step that ends here */
    const hd_real *velocity; /* 6 */
    const hd_real *down;     /* 3 */
    const hd_real *wrench;   /* 6 */
    const hd_real *channels; /* n_channels, held until the next sample */
    hd_real opening;         /* u_c over the step that begins here, m/s */
    hd_real closing;         /* u_c where this sample ends a step, m/s */
} hd_sample;

/* A sample packed as: time or length, velocity 6, down 3, wrench 6, opening, closing, channels. */
hd_sample hd_unpacked(const hd_real *values, hd_real length);

/* atoms.c ------------------------------------------------------------------ */
size_t hd_atom_count(size_t n_channels);

/* Every atom of one sample; atom i goes to atoms[i * stride]. */
void hd_atoms(const hd_real velocity[6], const hd_real down[3], const hd_real *channels,
              size_t n_channels, hd_real propulsion_speed, hd_real *atoms, size_t stride);

/* xi[j] = product of the four atoms of term j. */
void hd_terms(const int32_t *factors, size_t n_terms, const hd_real *atoms, hd_real *xi);

/* xi as above and force[6] = K xi, in one sweep. */
void hd_damping(const int32_t *factors, size_t n_terms, const hd_real *atoms,
                const hd_real *matrix, hd_real *xi, hd_real force[6]);

/* motion.c ----------------------------------------------------------------- */
/* product[6] = M nu. */
void hd_momentum(const hd_real mass[36], const hd_real velocity[6], hd_real product[6]);

/* out[6] += H(p) nu = [p1 x w ; p1 x v + p2 x w], linear in p and in nu = (v, w). */
void hd_add_moving_frame(const hd_real momentum[6], const hd_real velocity[6], hd_real out[6]);

/* wrench[6] = H(M nu) nu. */
void hd_coriolis(const hd_real mass[36], const hd_real velocity[6], hd_real wrench[6]);

/* inverse[6][6] of the mass matrix on the free axes, zero on the locked ones. */
void hd_mass_inverse(const hd_plant *plant, hd_real inverse[36]);

/* rate[6] = inverse * (H(M nu) nu + K xi + wrench). Atoms and xi are outputs, too. */
void hd_acceleration(const hd_plant *plant, const hd_real inverse[36], const hd_real *matrix,
                     const hd_real velocity[6], const hd_real down[3], const hd_real wrench[6],
                     const hd_real *channels, hd_real propulsion_speed, hd_real rate[6],
                     hd_real *atoms, hd_real *xi);

/* cholesky.c --------------------------------------------------------------- */
/* Solve a symmetric positive-definite system in place: matrix is overwritten, right
 * becomes the solution. Only the upper triangle is read. */
void hd_cholesky_six(hd_real matrix[36], hd_real right[6]);
/* The same for I + S with S >= 0: a pivot below 0.5, due to rounding, is replaced by 1. */
void hd_cholesky(hd_real *matrix, size_t n, hd_real *right);

/* The same in two parts: the factors serve for many right-hand sides. */
void hd_factorise(hd_real *matrix, size_t n);
void hd_solve(const hd_real *factors, size_t n, hd_real *right);

/* steps.c ------------------------------------------------------------------ */
/* One end of a step: velocity on the free axes, H(M nu) nu + wrench, and xi. */
typedef struct {
    hd_real velocity[6];
    hd_real known[6];
    hd_real *xi;
} hd_end;

/* Averages over the step between two samples. */
typedef struct {
    hd_real length;     /* h, s */
    hd_real change[6];  /* nu_{k+1} - nu_k on the free axes */
    hd_real forcing[6]; /* mean of H(M nu) nu + wrench at both ends */
    hd_real *xi;        /* mean of xi at both ends, n_terms */
} hd_step;

/* The step between two samples; its xi points into the workspace, of hd_step_work numbers. */
size_t hd_step_work(size_t n_terms, size_t n_channels);
void hd_step_between(const hd_plant *plant, const hd_sample *previous, const hd_sample *current,
                     hd_step *step, hd_real *work);

/* The same in two parts. */
void hd_end_at(const hd_plant *plant, const hd_sample *sample, const hd_real *channels,
               hd_real propulsion_speed, hd_real *atoms, hd_end *end);
void hd_between(const hd_plant *plant, const hd_end *first, const hd_end *second, hd_real length,
                hd_step *step);

/* adaptive.c --------------------------------------------------------------- */
/* One implicit midpoint step of eqs. 15-16, in place on matrix and error. */
void hd_adapt(const hd_plant *plant, const hd_real a[6], const hd_real *gamma, hd_real *matrix,
              hd_real error[6], const hd_step *step);

/* The error of the same step, and d at mid-step, from K xi and sum_j gamma_ij xi_j^2. */
void hd_error_step(const hd_plant *plant, const hd_real a[6], const hd_real force[6],
                   const hd_real stiffness[6], hd_real error[6], const hd_step *step, hd_real d[6]);

/* blocks.c ----------------------------------------------------------------- */
/* The current block of time: hd_block_size numbers, all 0 at the start of a segment. */
size_t hd_block_size(size_t n_terms);

/* Add a step; known as in hd_entries. 1 where it completes a second block: then row holds the
 * regressors (n_terms) and the target of each axis (6), over both blocks. */
int hd_block_add(const hd_plant *plant, const hd_real *known, const hd_step *step,
                 hd_real length, hd_real *block, hd_real *row);

/* recursive.c -------------------------------------------------------------- */
/* The coefficients that are estimated, axis by axis, and the table of the fixed ones. Axis i has
 * the coefficients starts[i] .. starts[i + 1] - 1, each a row of the table of terms. */
typedef struct {
    const int32_t *starts; /* 7 */
    const int32_t *rows;   /* starts[6] */
    const hd_real *known;  /* n_terms x 6, zero where a coefficient is estimated */
} hd_entries;

/* Settings and state of recursive least squares with directional forgetting. */
typedef struct {
    const hd_real *unit;   /* of each coefficient: prior standard deviation over that of
                              the noise of a row; 0 fixes it */
    hd_real forgetting;    /* share of the information along a row that the row replaces; < 1 */
    hd_real *coefficients; /* one an entry */
    hd_real *information;  /* of the data, n_i x n_i per axis, in these units */
    hd_real *noise;        /* 6: running variance of the normalised innovations */
    hd_real *rows;         /* 6: number of rows */
    hd_real *iv;      /* hd_iv_size(n_i) per axis */
} hd_estimate;

/* Start from these coefficients, before any data. */
void hd_recur_start(const hd_entries *entries, const hd_estimate *estimate,
                    const hd_real *coefficients);

/* Update the estimate with one row. Workspace: hd_absorb_work numbers. */
size_t hd_absorb_work(const hd_entries *entries);
void hd_absorb(const hd_entries *entries, const hd_estimate *estimate, size_t n_terms,
               const hd_real *row, hd_real *work);

/* composite.c -------------------------------------------------------------- */
/* Settings of the composite adaptive identifier. */
typedef struct {
    const hd_real *a, *gamma; /* 6: error gains, and adaptation gains in these units */
    const hd_real *unit;      /* of each coefficient; 0 fixes it */
    hd_real rate;             /* 1/s, of the filter */
    hd_real length;           /* s, of the blocks of time */
    hd_real kappa;            /* weight of the memory; 1/2 or more */
    hd_real forgetting;       /* share of the memory that a block replaces; < 1 */
} hd_composite;

/* The state: matrix (6 n_terms), error (6), filtered terms (n_terms) and target (6), time of the
 * block, number of blocks; of each axis Q (n), S (n x n), S at the last block, and the factors of
 * I + S. */
size_t hd_composite_size(const hd_entries *entries, size_t n_terms);
void hd_composite_start(const hd_entries *entries, size_t n_terms, const hd_real *coefficients,
                        hd_real *state);
void hd_composite_begin_segment(size_t n_terms, hd_real *state);

/* 1 where the step ends a block. Workspace: hd_composite_work numbers. */
size_t hd_composite_work(const hd_entries *entries);
int hd_composite_step(const hd_plant *plant, const hd_entries *entries, const hd_composite *law,
                      const hd_step *step, hd_real *state, hd_real *work);

/* instrumental_variables.c -------------------------------------------------- */
/* State of an axis with n coefficients: how many of the last 7 rows are of this segment, the last
 * 4 innovations, their products at 4 lags, the instrumental-variable estimate in units (n), its
 * moments (n x n), the last rows (7 x (n + 1)). All but the estimate start at 0. */
size_t hd_iv_size(size_t n);

/* Initialise before any data with these coefficients. */
void hd_iv_start(hd_real *iv, size_t n, const hd_real *coefficients,
                      const hd_real *unit);

/* Begin a segment: rows of the one before do not serve as instruments. */
void hd_iv_begin_segment(const hd_entries *entries, hd_real *iv);

/* Forget along phi, given S phi and factor = c / (phi'S phi). Workspace: n numbers. */
void hd_iv_forget(hd_real *iv, size_t n, const hd_real *phi, const hd_real *s_phi,
                   hd_real factor, hd_real *work);

/* Update with a row, its normalised innovation and the weight of that. Workspace: n x n + n. */
void hd_iv_update(hd_real *iv, size_t n, const hd_real *phi, hd_real target,
                  hd_real innovation, hd_real weight, hd_real *work);

/* identifiers.c ------------------------------------------------------------ */
/* The identifiers sample by sample. The caller owns the state, one array. */
typedef struct {
    const hd_plant *plant;
    const hd_entries *entries;
    const hd_real *a, *gamma; /* of hd_adapt */
} hd_ai;

typedef struct {
    const hd_plant *plant;
    const hd_entries *entries;
    const hd_composite *law;
} hd_ai_composite;

typedef struct {
    const hd_plant *plant;
    const hd_entries *entries;
    const hd_real *unit; /* and forgetting: of hd_estimate */
    hd_real forgetting;
    hd_real length; /* s, of the blocks */
} hd_rls;

/* Size of a state, of the part of it to save, and of the workspace of a step. */
size_t hd_ai_size(const hd_ai *ai);
size_t hd_ai_lasting(const hd_ai *ai);
size_t hd_ai_work(const hd_ai *ai);
size_t hd_ai_composite_size(const hd_ai_composite *ai);
size_t hd_ai_composite_lasting(const hd_ai_composite *ai);
size_t hd_ai_composite_work(const hd_ai_composite *ai);
size_t hd_rls_size(const hd_rls *rls);
size_t hd_rls_lasting(const hd_rls *rls);
size_t hd_rls_work(const hd_rls *rls);

/* Start from these coefficients. The first sample begins a run. */
void hd_ai_init(const hd_ai *ai, const hd_real *coefficients, hd_real *state);
void hd_ai_composite_init(const hd_ai_composite *ai, const hd_real *coefficients, hd_real *state);
void hd_rls_init(const hd_rls *rls, const hd_real *coefficients, hd_real *state);

/* Let the next sample begin a run, as after a gap. */
void hd_run_begins(hd_real *state);

/* Process a sample. 0 where it is discarded: a number is not finite, or so large that the state
 * would overflow, and the next sample begins a run; or its length is not positive, and the run
 * continues. The estimate is then unchanged. 2 where the sample updated it, else 1. */
int hd_ai_step(const hd_ai *ai, const hd_sample *sample, hd_real *state, hd_real *work);
int hd_ai_composite_step(const hd_ai_composite *ai, const hd_sample *sample, hd_real *state,
                         hd_real *work);
int hd_rls_step(const hd_rls *rls, const hd_sample *sample, hd_real *state, hd_real *work);

/* The present coefficients, in the order of the entries. */
void hd_ai_estimate(const hd_ai *ai, const hd_real *state, hd_real *coefficients);
void hd_ai_composite_estimate(const hd_ai_composite *ai, const hd_real *state,
                              hd_real *coefficients);
void hd_rls_estimate(const hd_rls *rls, const hd_real *state, hd_real *coefficients);

/* Save a state of n numbers as n * sizeof(hd_real) + 4 bytes, and restore it; 0 where the bytes
 * are damaged or have another mark. The mark identifies vehicle, model and method. */
void hd_keep(const hd_real *state, size_t n, uint32_t mark, unsigned char *saved);
int hd_restore(const unsigned char *saved, size_t n, uint32_t mark, hd_real *state);

#ifdef __cplusplus
}
#endif
#endif
