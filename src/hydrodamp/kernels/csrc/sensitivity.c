/* Forward sensitivities: the derivative of exactly the RK4 step that replay takes.
 *
 * With state x (velocity and, where simulated, quaternion), its derivative S on
 * the p coefficients and the six initial velocities obeys dS/dt = J S + B, where
 * J = d rate / d x and B holds M^-1 e_axis xi_term in the column of (term, axis).
 * Every stage of the step is differentiated, and so is the normalisation.
 */
#include "batch.h"

typedef struct {
    const hd_plant *plant;
    const hd_real *inverse; /* 6 x 6 */
    const hd_real *matrix;
    const int32_t *parameters;
    const hd_interval *interval;
    size_t n_parameters;
    size_t n_states;
    size_t width;              /* columns of S: n_parameters + 6 */
    hd_real *work;             /* atoms and xi */
    hd_real *weights;          /* n_atoms x 6 */
    hd_real *stage, *rate, *sum; /* n_states x width each */
} tangent;

size_t hd_sensitivity_work(size_t n_terms, size_t n_channels, size_t n_parameters)
{
    return 7 * hd_atom_count(n_channels) + n_terms + 4 * 10 * (n_parameters + 6);
}

/* out[6][n] (row length `row`) = inverse[6][6] * in[6][n], both from column 0 */
static void solve(const hd_real inverse[36], const hd_real *in, size_t n, hd_real *out, size_t row)
{
    for (size_t i = 0; i < 6; ++i)
        for (size_t k = 0; k < n; ++k) {
            hd_real total = 0;
            for (size_t l = 0; l < 6; ++l)
                total += inverse[6 * i + l] * in[n * l + k];
            out[row * i + k] = total;
        }
}

/* jacobian (n_states x n_states) = d rate / d state; weights hold d (K xi) / d atom */
static void state_slope(const tangent *t, const hd_real *state, hd_real *jacobian)
{
    const size_t n = t->n_states;
    hd_real damping[36], force[36], down[12], lift[24], by_omega[12], by_itself[16];

    for (size_t i = 0; i < n * n; ++i)
        jacobian[i] = 0;
    hd_atom_slopes(state, t->interval->propulsion_speed, t->weights, damping);
    hd_coriolis_slope(t->plant->mass, state, force);
    for (size_t i = 0; i < 36; ++i)
        force[i] += damping[i];
    solve(t->inverse, force, 6, jacobian, n);
    if (n == 6)
        return;
    hd_down_slope(state + 6, down);
    for (size_t i = 0; i < 6; ++i)
        for (size_t k = 0; k < 4; ++k) {
            lift[4 * i + k] = 0;
            for (size_t l = 0; l < 3; ++l)
                lift[4 * i + k] += t->weights[6 * (18 + l) + i] * down[4 * l + k];
        }
    solve(t->inverse, lift, 4, jacobian + 6, n);
    hd_quaternion_by_omega(state + 6, by_omega);
    hd_quaternion_by_itself(state + 3, by_itself);
    for (size_t i = 0; i < 4; ++i) {
        for (size_t k = 0; k < 3; ++k)
            jacobian[n * (6 + i) + 3 + k] = by_omega[3 * i + k];
        for (size_t k = 0; k < 4; ++k)
            jacobian[n * (6 + i) + 6 + k] = by_itself[4 * i + k];
    }
}

/* to = sum of the six velocity rows of the slope, each times its factor */
static void six_rows(const hd_real f[6], const hd_real *restrict from, size_t width,
                     hd_real *restrict to)
{
    const hd_real *u = from, *v = u + width, *w = v + width;
    const hd_real *p = w + width, *q = p + width, *r = q + width;

    for (size_t c = 0; c < width; ++c)
        to[c] = f[0] * u[c] + f[1] * v[c] + f[2] * w[c] + f[3] * p[c] + f[4] * q[c] + f[5] * r[c];
}

/* to += sum of the four quaternion rows of the slope, each times its factor */
static void four_rows(const hd_real f[4], const hd_real *restrict from, size_t width,
                      hd_real *restrict to)
{
    const hd_real *w = from, *x = w + width, *y = x + width, *z = y + width;

    for (size_t c = 0; c < width; ++c)
        to[c] += f[0] * w[c] + f[1] * x[c] + f[2] * y[c] + f[3] * z[c];
}

/* t->rate = jacobian * slope, then plus M^-1 e_axis xi_term for each coefficient */
static void slope_rate(const tangent *t, const hd_real *jacobian, const hd_real *xi,
                       const hd_real *slope)
{
    const size_t n = t->n_states, width = t->width;

    for (size_t i = 0; i < n; ++i) {
        six_rows(jacobian + n * i, slope, width, t->rate + width * i);
        if (n > 6)
            four_rows(jacobian + n * i + 6, slope + 6 * width, width, t->rate + width * i);
    }
    for (size_t c = 0; c < t->n_parameters; ++c) {
        const hd_real value = xi[t->parameters[2 * c]];
        const hd_real *column = t->inverse + 6 * t->parameters[2 * c + 1];
        for (size_t i = 0; i < 6; ++i)
            t->rate[width * i + c] += column[i] * value;
    }
}

/* Rate of the state; its slope's rate goes to t->rate. */
static void rates(const tangent *t, const hd_real *state, const hd_real *slope, hd_real fraction,
                  hd_real *rate)
{
    const hd_interval *interval = t->interval;
    const size_t n_atoms = hd_atom_count(t->plant->n_channels);
    hd_real wrench[6], down[3], jacobian[100];

    hd_blend(interval->wrench[0], interval->wrench[1], fraction, 6, wrench);
    hd_blend(interval->down[0], interval->down[1], fraction, 3, down);
    if (t->n_states > 6) {
        hd_down(state + 6, down);
        hd_quaternion_rate(state + 6, state + 3, rate + 6);
    }
    hd_acceleration(t->plant, t->inverse, t->matrix, state, down, wrench, interval->channels,
                    interval->propulsion_speed, rate, t->work); /* leaves atoms, xi in work */
    hd_atom_weights(t->plant->factors, t->plant->n_terms, t->work, n_atoms, t->matrix,
                    t->weights);
    state_slope(t, state, jacobian);
    slope_rate(t, jacobian, t->work + n_atoms, slope);
}

/* q <- q/|q|, S_q <- (I - q q') S_q / |q| */
static void normalise(const tangent *t, hd_real *q, hd_real *slope)
{
    const hd_real length = hd_normalise(q);

    for (size_t c = 0; c < t->width; ++c) {
        hd_real along = 0;
        for (size_t i = 0; i < 4; ++i)
            along += q[i] * slope[t->width * i + c];
        for (size_t i = 0; i < 4; ++i)
            slope[t->width * i + c] = (slope[t->width * i + c] - q[i] * along) / length;
    }
}

/* One RK4 step of length h of state and slope, sub-step `index` of the interval. */
static void rk4(const tangent *t, hd_real h, size_t index, hd_real *state, hd_real *slope)
{
    static const hd_real reach[4] = {0, (hd_real)0.5, (hd_real)0.5, 1}; /* of each stage */
    static const hd_real share[4] = {1, 2, 2, 1};                       /* sixths of h */
    const size_t n = t->n_states, size = n * t->width;
    hd_real stage[10], rate[10] = {0}, sum[10] = {0};

    for (size_t i = 0; i < size; ++i)
        t->sum[i] = t->rate[i] = 0;
    for (size_t k = 0; k < 4; ++k) {
        const hd_real ahead = reach[k] * h;
        const hd_real fraction = ((hd_real)index + reach[k]) / (hd_real)t->interval->steps;
        for (size_t i = 0; i < n; ++i)
            stage[i] = state[i] + ahead * rate[i];
        for (size_t i = 0; i < size; ++i)
            t->stage[i] = slope[i] + ahead * t->rate[i];
        rates(t, stage, t->stage, fraction, rate);
        for (size_t i = 0; i < n; ++i)
            sum[i] += share[k] * rate[i];
        for (size_t i = 0; i < size; ++i)
            t->sum[i] += share[k] * t->rate[i];
    }
    for (size_t i = 0; i < n; ++i)
        state[i] += h / 6 * sum[i];
    for (size_t i = 0; i < size; ++i)
        slope[i] += h / 6 * t->sum[i];
    if (n > 6)
        normalise(t, state + 6, slope + 6 * t->width);
}

static void start_segment(const tangent *t, const hd_real *velocity, const hd_real *attitude,
                          hd_real *state, hd_real *slope)
{
    for (size_t i = 0; i < t->n_states * t->width; ++i)
        slope[i] = 0;
    for (size_t i = 0; i < 6; ++i) {
        state[i] = t->plant->free_axes[i] ? velocity[i] : 0;
        slope[t->width * i + t->n_parameters + i] = t->plant->free_axes[i] ? 1 : 0;
    }
    if (attitude) {
        for (size_t i = 0; i < 4; ++i)
            state[6 + i] = attitude[i];
        (void)hd_normalise(state + 6);
    }
}

void hd_sensitivities(const hd_plant *plant, const hd_real *matrix, const int32_t *parameters,
                      size_t n_parameters, const hd_record *record, const int64_t *segments,
                      size_t n_segments, const hd_real *attitude, hd_real max_step,
                      hd_real limit, hd_real *velocity, hd_real *jacobian, hd_real *work)
{
    const size_t n_atoms = hd_atom_count(plant->n_channels), width = n_parameters + 6;
    hd_real *weights = work + n_atoms + plant->n_terms, *slope = weights + 6 * n_atoms;
    hd_real inverse[36], state[10];
    tangent t = {plant,          inverse,           matrix, parameters,
                 NULL,           n_parameters,      attitude ? 10 : 6, width,
                 work,           weights,           slope + 10 * width,
                 slope + 20 * width, slope + 30 * width};

    hd_mass_inverse(plant, inverse);
    for (size_t i = 0; i < 6 * record->n; ++i)
        velocity[i] = (hd_real)NAN;
    for (size_t i = 0; i < 6 * width * record->n; ++i)
        jacobian[i] = (hd_real)NAN;
    for (size_t s = 0; s < n_segments; ++s) {
        const size_t start = (size_t)segments[2 * s], stop = (size_t)segments[2 * s + 1];
        start_segment(&t, record->velocity + 6 * start, attitude ? attitude + 4 * start : NULL,
                      state, slope);
        for (size_t k = start; k < stop; ++k) {
            if (k > start) {
                const hd_interval interval = hd_interval_after(record, k - 1, max_step);
                t.interval = &interval;
                for (size_t i = 0; i < interval.steps; ++i)
                    rk4(&t, interval.length / (hd_real)interval.steps, i, state, slope);
            }
            if (hd_diverged(state, limit))
                break;
            for (size_t i = 0; i < 6; ++i)
                velocity[6 * k + i] = state[i];
            for (size_t i = 0; i < 6 * width; ++i)
                jacobian[6 * width * k + i] = slope[i];
        }
    }
}
