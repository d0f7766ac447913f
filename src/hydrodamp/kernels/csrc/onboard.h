/* hydrodamp on board: equation 1 of a marine vehicle and what estimates it, in C99.
 *
 *   M dnu/dt = H(M nu) nu + K xi(nu) + wrench                        (eq. 1)
 *
 * No allocation, no input or output, no state between calls: the caller owns
 * every array, workspaces included. Numbers are hd_real: double, or float with
 * -DHD_FLOAT. Sums run in a fixed order; build with -ffp-contract=off and never
 * with -ffast-math, and every machine gives the same bits.
 *
 * Frames: body x forward, y starboard, z down; wrenches X Y Z [N], K M N [N m]
 * stand on the right-hand side. Matrices are row-major, but for the mass matrix,
 * which lies column by column. A coefficient matrix holds one row a term and the
 * six axes side by side: the transpose of K.
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
#else
#define HD_REAL double
#define hd_sqrt sqrt
#define hd_fabs fabs
#define hd_ceil ceil
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef HD_REAL hd_real;

enum {
    HD_FIXED_ATOMS = 21,
    HD_PACKED = 18 /* numbers of a packed sample before its channels */
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

/* rate[6] = inverse * (H(M nu) nu + K xi + wrench). Atoms and xi are left in theirs. */
void hd_acceleration(const hd_plant *plant, const hd_real inverse[36], const hd_real *matrix,
                     const hd_real velocity[6], const hd_real down[3], const hd_real wrench[6],
                     const hd_real *channels, hd_real propulsion_speed, hd_real rate[6],
                     hd_real *atoms, hd_real *xi);

/* cholesky.c --------------------------------------------------------------- */
/* Solve a symmetric positive-definite system in place: matrix is destroyed, right becomes
 * the solution. Only the upper triangle is read. */
void hd_cholesky_six(hd_real matrix[36], hd_real right[6]);
/* Of I + S with S >= 0: a pivot that rounding has made much less than 1 counts as 1. */
void hd_cholesky(hd_real *matrix, size_t n, hd_real *right);

/* steps.c ------------------------------------------------------------------ */
/* One end of a step: velocity on the free axes, H(M nu) nu + wrench, and xi. */
typedef struct {
    hd_real velocity[6];
    hd_real known[6];
    hd_real *xi;
} hd_end;

/* What a step between two samples needs. */
typedef struct {
    hd_real length;     /* h, s */
    hd_real change[6];  /* nu_{k+1} - nu_k on the free axes */
    hd_real forcing[6]; /* mean of H(M nu) nu + wrench at both ends */
    hd_real *xi;        /* mean of xi at both ends, n_terms */
} hd_step;

/* The step between two samples; its xi lies in the workspace, of hd_step_work numbers. */
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

/* blocks.c ----------------------------------------------------------------- */
/* The block of time under way: hd_block_size numbers, all 0 at the start of a segment. */
size_t hd_block_size(size_t n_terms);

/* Add a step; known as in hd_entries. 1 where that fills a second block: then row holds the
 * terms (n_terms), and behind them what they are to explain on each axis (6), over both. */
int hd_block_add(const hd_plant *plant, const hd_real *known, const hd_step *step,
                 hd_real length, hd_real *block, hd_real *row);

/* recursive.c -------------------------------------------------------------- */
/* The coefficients that move, axis by axis, and the table of those that do not. Axis i has
 * the coefficients starts[i] .. starts[i + 1] - 1, each a row of the table of terms. */
typedef struct {
    const int32_t *starts; /* 7 */
    const int32_t *rows;   /* starts[6] */
    const hd_real *known;  /* n_terms x 6, zero where a coefficient moves */
} hd_entries;

/* Settings and state of recursive least squares with directional forgetting. */
typedef struct {
    const hd_real *unit;   /* of each coefficient: its prior deviation over that of a row's
                              noise; 0 holds it */
    hd_real forgetting;    /* share of the information along a row that it replaces; < 1 */
    hd_real *coefficients; /* one an entry */
    hd_real *information;  /* the data's, n_i x n_i, one behind the other, in those units */
    hd_real *noise;        /* 6: running variance of what is left over */
    hd_real *rows;         /* 6: how many rows there were */
    hd_real *witness;      /* hd_witness_size(n_i) an axis, one behind the other */
} hd_estimate;

/* Start from these coefficients, before any data. */
void hd_recur_start(const hd_entries *entries, const hd_estimate *estimate,
                    const hd_real *coefficients);

/* Take in one row. Workspace: hd_absorb_work numbers. */
size_t hd_absorb_work(const hd_entries *entries);
void hd_absorb(const hd_entries *entries, const hd_estimate *estimate, size_t n_terms,
               const hd_real *row, hd_real *work);

/* witness.c ---------------------------------------------------------------- */
/* What tells how far an axis with n coefficients may be off: how many of the last 7 rows are of
 * this segment, what the last 4 left over, its products at 4 lags, an estimate by instruments in
 * units (n), its moments (n x n), the last rows (7 x (n + 1)). All 0 but the estimate at first. */
size_t hd_witness_size(size_t n);

/* Before any data, at these coefficients in these units. */
void hd_witness_start(hd_real *witness, size_t n, const hd_real *coefficients,
                      const hd_real *unit);

/* Another segment begins: rows of the one before are no neighbours. */
void hd_witness_break(const hd_entries *entries, hd_real *witness);

/* Forget along S phi, a part c / (phi'S phi). Workspace: n numbers. */
void hd_witness_forget(hd_real *witness, size_t n, const hd_real *phi, const hd_real *seen,
                       hd_real part, hd_real *work);

/* Take in a row that leaves so much over, which weighs so much. Workspace: n x n + n numbers. */
void hd_witness_row(hd_real *witness, size_t n, const hd_real *phi, hd_real target, hd_real left,
                    hd_real weight, hd_real *work);

/* identifiers.c ------------------------------------------------------------ */
/* Identifiers at work, a sample a call. The state, the last sample included, is one array of
 * the caller's. */
typedef struct {
    const hd_plant *plant;
    const hd_entries *entries;
    const hd_real *a, *gamma; /* of hd_adapt */
} hd_ai;

typedef struct {
    const hd_plant *plant;
    const hd_entries *entries;
    const hd_real *unit; /* and forgetting: of hd_estimate */
    hd_real forgetting;
    hd_real length; /* s, of the blocks */
} hd_rls;

/* Numbers of a state, of its first part, which is to be kept, and of the workspace of a step. */
size_t hd_ai_size(const hd_ai *ai);
size_t hd_ai_lasting(const hd_ai *ai);
size_t hd_ai_work(const hd_ai *ai);
size_t hd_rls_size(const hd_rls *rls);
size_t hd_rls_lasting(const hd_rls *rls);
size_t hd_rls_work(const hd_rls *rls);

/* Start from these coefficients. The first sample begins a run. */
void hd_ai_init(const hd_ai *ai, const hd_real *coefficients, hd_real *state);
void hd_rls_init(const hd_rls *rls, const hd_real *coefficients, hd_real *state);

/* Let the next sample begin a run, as after a gap: no step leads to it. */
void hd_run_begins(hd_real *state);

/* Take in a sample. 0 where it is left out: a number is not finite or so large that the state
 * would not stay finite, and the next one begins a run; or its length is not positive, and the
 * run goes on. The estimate stays as it is. 2 where the sample moved it. */
int hd_ai_step(const hd_ai *ai, const hd_sample *sample, hd_real *state, hd_real *work);
int hd_rls_step(const hd_rls *rls, const hd_sample *sample, hd_real *state, hd_real *work);

/* The present coefficients, in the order of the entries. */
void hd_ai_estimate(const hd_ai *ai, const hd_real *state, hd_real *coefficients);
void hd_rls_estimate(const hd_rls *rls, const hd_real *state, hd_real *coefficients);

/* A state of n numbers as bytes to keep, n * sizeof(hd_real) + 4, and back; 0 where they are
 * damaged, or of another mark. A mark tells vehicle, model and method. */
void hd_keep(const hd_real *state, size_t n, uint32_t mark, unsigned char *kept);
int hd_restore(const unsigned char *kept, size_t n, uint32_t mark, hd_real *state);

#ifdef __cplusplus
}
#endif
#endif
