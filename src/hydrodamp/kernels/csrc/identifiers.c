/* The identifiers sample by sample, for use on board. One array holds the state:
 *
 *   the last sample, packed; 0 in place of its length where the next sample begins a run
 *   adaptive identifier: the matrix and the velocity error
 *   composite adaptive identifier: the state of composite.c
 *   recursive least squares: the block of time, then the arrays that hd_estimate points to
 *   a backup of what a step replaces, restored where its result is not finite
 */
#include "onboard.h"

static size_t sample_size(const hd_plant *plant)
{
    return HD_PACKED + plant->n_channels;
}

static void copy(hd_real *to, const hd_real *from, size_t n)
{
    for (size_t i = 0; i < n; ++i)
        to[i] = from[i];
}

static void clear(hd_real *to, size_t n)
{
    for (size_t i = 0; i < n; ++i)
        to[i] = 0;
}

static int are_finite(const hd_real *values, size_t n)
{
    for (size_t i = 0; i < n; ++i)
        if (!(values[i] - values[i] == 0))
            return 0;
    return 1;
}

static int is_finite(const hd_plant *plant, const hd_sample *sample)
{
    const hd_real speeds[2] = {sample->opening, sample->closing};

    return are_finite(sample->velocity, 6) && are_finite(sample->down, 3) &&
           are_finite(sample->wrench, 6) && are_finite(speeds, 2) &&
           are_finite(sample->channels, plant->n_channels);
}

void hd_run_begins(hd_real *state)
{
    state[0] = 0;
}

/* How a sample is used: discarded, first of a run, or the end of a step. */
enum { DISCARDED, FIRST, NEXT };

static int classify(const hd_plant *plant, const hd_sample *sample, hd_real *state)
{
    if (!is_finite(plant, sample)) {
        hd_run_begins(state);
        return DISCARDED;
    }
    if (!(state[0] > 0))
        return FIRST;
    return are_finite(&sample->length, 1) && sample->length > 0 ? NEXT : DISCARDED;
}

static void store_sample(const hd_plant *plant, const hd_sample *sample, hd_real *state)
{
    state[0] = 1;
    copy(state + 1, sample->velocity, 6);
    copy(state + 7, sample->down, 3);
    copy(state + 10, sample->wrench, 6);
    state[16] = sample->opening;
    state[17] = sample->closing;
    copy(state + HD_PACKED, sample->channels, plant->n_channels);
}

/* Whether the new values are finite; otherwise restore the backup, and a run begins. */
static int accept(hd_real *values, const hd_real *backup, size_t n, hd_real *state)
{
    if (are_finite(values, n))
        return 1;
    copy(values, backup, n);
    hd_run_begins(state);
    return 0;
}

/* The coefficients of the entries in a matrix. */
static void gather(const hd_entries *entries, const hd_real *matrix, hd_real *coefficients)
{
    for (size_t i = 0; i < 6; ++i)
        for (int32_t j = entries->starts[i]; j < entries->starts[i + 1]; ++j)
            coefficients[j] = matrix[6 * (size_t)entries->rows[j] + i];
}

/* The adaptive identifier. */
static size_t matrix_size(const hd_ai *ai) /* and the error */
{
    return 6 * ai->plant->n_terms + 6;
}

size_t hd_ai_lasting(const hd_ai *ai)
{
    return sample_size(ai->plant) + matrix_size(ai);
}

size_t hd_ai_size(const hd_ai *ai)
{
    return hd_ai_lasting(ai) + matrix_size(ai);
}

size_t hd_ai_work(const hd_ai *ai)
{
    return hd_step_work(ai->plant->n_terms, ai->plant->n_channels);
}

void hd_ai_init(const hd_ai *ai, const hd_real *coefficients, hd_real *state)
{
    hd_real *matrix = state + sample_size(ai->plant);
    const hd_entries *entries = ai->entries;

    clear(state, hd_ai_size(ai));
    copy(matrix, entries->known, 6 * ai->plant->n_terms);
    for (size_t i = 0; i < 6; ++i)
        for (int32_t j = entries->starts[i]; j < entries->starts[i + 1]; ++j)
            matrix[6 * (size_t)entries->rows[j] + i] = coefficients[j];
}

int hd_ai_step(const hd_ai *ai, const hd_sample *sample, hd_real *state, hd_real *work)
{
    const hd_plant *plant = ai->plant;
    const hd_sample last = hd_unpacked(state, 0);
    hd_real *matrix = state + sample_size(plant), *error = matrix + 6 * plant->n_terms;
    const int kind = classify(plant, sample, state);
    hd_step step;

    if (kind == DISCARDED)
        return 0;
    if (kind == FIRST) {
        clear(error, 6);
    } else {
        hd_real *backup = state + hd_ai_lasting(ai);
        copy(backup, matrix, matrix_size(ai));
        hd_step_between(plant, &last, sample, &step, work);
        hd_adapt(plant, ai->a, ai->gamma, matrix, error, &step);
        if (!accept(matrix, backup, matrix_size(ai), state))
            return DISCARDED;
    }
    store_sample(plant, sample, state);
    return kind;
}

void hd_ai_estimate(const hd_ai *ai, const hd_real *state, hd_real *coefficients)
{
    gather(ai->entries, state + sample_size(ai->plant), coefficients);
}

/* The composite adaptive identifier. */
static size_t composite_size(const hd_ai_composite *ai)
{
    return hd_composite_size(ai->entries, ai->plant->n_terms);
}

size_t hd_ai_composite_lasting(const hd_ai_composite *ai)
{
    return sample_size(ai->plant) + composite_size(ai);
}

size_t hd_ai_composite_size(const hd_ai_composite *ai)
{
    return hd_ai_composite_lasting(ai) + composite_size(ai);
}

size_t hd_ai_composite_work(const hd_ai_composite *ai)
{
    return hd_step_work(ai->plant->n_terms, ai->plant->n_channels) +
           hd_composite_work(ai->entries);
}

void hd_ai_composite_init(const hd_ai_composite *ai, const hd_real *coefficients, hd_real *state)
{
    clear(state, hd_ai_composite_size(ai));
    hd_composite_start(ai->entries, ai->plant->n_terms, coefficients,
                       state + sample_size(ai->plant));
}

int hd_ai_composite_step(const hd_ai_composite *ai, const hd_sample *sample, hd_real *state,
                         hd_real *work)
{
    const hd_plant *plant = ai->plant;
    const hd_sample last = hd_unpacked(state, 0);
    hd_real *values = state + sample_size(plant);
    const int kind = classify(plant, sample, state);
    hd_step step;

    if (kind == DISCARDED)
        return 0;
    if (kind == FIRST) {
        hd_composite_begin_segment(plant->n_terms, values);
    } else {
        hd_real *backup = state + hd_ai_composite_lasting(ai);
        copy(backup, values, composite_size(ai));
        hd_step_between(plant, &last, sample, &step, work);
        (void)hd_composite_step(plant, ai->entries, ai->law, &step, values,
                                work + hd_step_work(plant->n_terms, plant->n_channels));
        if (!accept(values, backup, composite_size(ai), state))
            return DISCARDED;
    }
    store_sample(plant, sample, state);
    return kind;
}

void hd_ai_composite_estimate(const hd_ai_composite *ai, const hd_real *state,
                              hd_real *coefficients)
{
    gather(ai->entries, state + sample_size(ai->plant), coefficients);
}

/* Recursive least squares. */
static size_t estimate_offset(const hd_rls *rls)
{
    return sample_size(rls->plant) + hd_block_size(rls->plant->n_terms);
}

static size_t information_size(const hd_entries *entries)
{
    size_t sum = 0;

    for (size_t i = 0; i < 6; ++i) {
        const size_t n = (size_t)(entries->starts[i + 1] - entries->starts[i]);
        sum += n * n;
    }
    return sum;
}

/* The arrays of hd_estimate inside a state. */
static hd_estimate estimate_in(const hd_rls *rls, hd_real *state)
{
    hd_real *coefficients = state + estimate_offset(rls);
    hd_real *information = coefficients + rls->entries->starts[6];
    hd_real *noise = information + information_size(rls->entries);
    const hd_estimate estimate = {
        rls->unit, rls->forgetting, coefficients, information, noise, noise + 6, noise + 12,
    };

    return estimate;
}

static size_t estimate_size(const hd_entries *entries)
{
    size_t size = (size_t)entries->starts[6] + information_size(entries) + 12;

    for (size_t i = 0; i < 6; ++i)
        size += hd_iv_size((size_t)(entries->starts[i + 1] - entries->starts[i]));
    return size;
}

size_t hd_rls_lasting(const hd_rls *rls)
{
    return estimate_offset(rls) + estimate_size(rls->entries);
}

size_t hd_rls_size(const hd_rls *rls)
{
    return hd_rls_lasting(rls) + estimate_size(rls->entries);
}

size_t hd_rls_work(const hd_rls *rls)
{
    const hd_plant *plant = rls->plant;

    return hd_step_work(plant->n_terms, plant->n_channels) + plant->n_terms + 6 +
           hd_absorb_work(rls->entries);
}

void hd_rls_init(const hd_rls *rls, const hd_real *coefficients, hd_real *state)
{
    const hd_estimate estimate = estimate_in(rls, state);

    clear(state, hd_rls_size(rls));
    hd_recur_start(rls->entries, &estimate, coefficients);
}

int hd_rls_step(const hd_rls *rls, const hd_sample *sample, hd_real *state, hd_real *work)
{
    const hd_plant *plant = rls->plant;
    const hd_sample last = hd_unpacked(state, 0);
    const hd_estimate estimate = estimate_in(rls, state);
    hd_real *block = state + sample_size(plant);
    hd_real *row = work + hd_step_work(plant->n_terms, plant->n_channels);
    const int kind = classify(plant, sample, state);
    int updated = 0;
    hd_step step;

    if (kind == DISCARDED)
        return 0;
    if (kind == FIRST) {
        clear(block, hd_block_size(plant->n_terms));
        hd_iv_begin_segment(rls->entries, estimate.iv);
    } else {
        hd_step_between(plant, &last, sample, &step, work);
        updated = hd_block_add(plant, rls->entries->known, &step, rls->length, block, row);
        if (!are_finite(block, hd_block_size(plant->n_terms))) {
            clear(block, hd_block_size(plant->n_terms));
            hd_run_begins(state);
            return DISCARDED;
        }
    }
    if (updated) {
        hd_real *current = state + estimate_offset(rls), *backup = state + hd_rls_lasting(rls);
        const size_t n = estimate_size(rls->entries);
        copy(backup, current, n);
        hd_absorb(rls->entries, &estimate, plant->n_terms, row, row + plant->n_terms + 6);
        if (!accept(current, backup, n, state))
            return DISCARDED;
    }
    store_sample(plant, sample, state);
    return 1 + updated;
}

void hd_rls_estimate(const hd_rls *rls, const hd_real *state, hd_real *coefficients)
{
    copy(coefficients, state + estimate_offset(rls), (size_t)rls->entries->starts[6]);
}

/* FNV-1a hash, seeded with the mark and the size of a number. */
static uint32_t checksum(const unsigned char *bytes, size_t n, uint32_t mark)
{
    uint32_t sum = (UINT32_C(2166136261) ^ mark ^ (uint32_t)sizeof(hd_real)) * UINT32_C(16777619);

    for (size_t i = 0; i < n; ++i)
        sum = (sum ^ bytes[i]) * UINT32_C(16777619);
    return sum;
}

void hd_keep(const hd_real *state, size_t n, uint32_t mark, unsigned char *saved)
{
    const unsigned char *bytes = (const unsigned char *)state;
    const size_t size = n * sizeof *state;
    const uint32_t sum = checksum(bytes, size, mark);

    for (size_t i = 0; i < size; ++i)
        saved[i] = bytes[i];
    for (size_t i = 0; i < 4; ++i)
        saved[size + i] = (unsigned char)(sum >> (8 * i));
}

int hd_restore(const unsigned char *saved, size_t n, uint32_t mark, hd_real *state)
{
    const size_t size = n * sizeof *state;
    const uint32_t sum = checksum(saved, size, mark);
    unsigned char *bytes = (unsigned char *)state;

    for (size_t i = 0; i < 4; ++i)
        if (saved[size + i] != (unsigned char)(sum >> (8 * i)))
            return 0;
    for (size_t i = 0; i < size; ++i)
        bytes[i] = saved[i];
    return 1;
}
