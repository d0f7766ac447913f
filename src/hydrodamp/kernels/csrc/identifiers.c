/* Identifiers at work on board: one array holds all their state.
 *
 * It begins with the last sample, packed; a 0 in place of its length says that no run is under
 * way. Behind it stand the matrix and the error of the adaptive identifier; or the block of
 * time, the coefficients and what else hd_estimate points to. Last stands a spare copy of what
 * the last step replaced, to go back to where its result is not finite.
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

/* What becomes of a sample: left out, first of a run, or with a step that leads to it. */
enum { LEFT_OUT, FIRST, NEXT };

static int judge(const hd_plant *plant, const hd_sample *sample, hd_real *state)
{
    if (!is_finite(plant, sample)) {
        hd_run_begins(state);
        return LEFT_OUT;
    }
    if (!(state[0] > 0))
        return FIRST;
    return are_finite(&sample->length, 1) && sample->length > 0 ? NEXT : LEFT_OUT;
}

static void remember(const hd_plant *plant, const hd_sample *sample, hd_real *state)
{
    state[0] = 1;
    copy(state + 1, sample->velocity, 6);
    copy(state + 7, sample->down, 3);
    copy(state + 10, sample->wrench, 6);
    state[16] = sample->opening;
    state[17] = sample->closing;
    copy(state + HD_PACKED, sample->channels, plant->n_channels);
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
    const int is = judge(plant, sample, state);
    hd_step step;

    if (is == LEFT_OUT)
        return 0;
    if (is == FIRST) {
        clear(error, 6);
    } else {
        hd_real *spare = state + hd_ai_lasting(ai);
        copy(spare, matrix, matrix_size(ai));
        hd_step_between(plant, &last, sample, &step, work);
        hd_adapt(plant, ai->a, ai->gamma, matrix, error, &step);
        if (!are_finite(matrix, matrix_size(ai))) {
            copy(matrix, spare, matrix_size(ai));
            hd_run_begins(state);
            return LEFT_OUT;
        }
    }
    remember(plant, sample, state);
    return is;
}

void hd_ai_estimate(const hd_ai *ai, const hd_real *state, hd_real *coefficients)
{
    const hd_real *matrix = state + sample_size(ai->plant);
    const hd_entries *entries = ai->entries;

    for (size_t i = 0; i < 6; ++i)
        for (int32_t j = entries->starts[i]; j < entries->starts[i + 1]; ++j)
            coefficients[j] = matrix[6 * (size_t)entries->rows[j] + i];
}

/* Recursive least squares. */
static size_t before_estimate(const hd_rls *rls)
{
    return sample_size(rls->plant) + hd_block_size(rls->plant->n_terms);
}

static size_t squares(const hd_entries *entries)
{
    size_t sum = 0;

    for (size_t i = 0; i < 6; ++i) {
        const size_t n = (size_t)(entries->starts[i + 1] - entries->starts[i]);
        sum += n * n;
    }
    return sum;
}

/* Where what hd_estimate points to lies in a state. */
static hd_estimate estimate_in(const hd_rls *rls, hd_real *state)
{
    hd_real *coefficients = state + before_estimate(rls);
    hd_real *information = coefficients + rls->entries->starts[6];
    hd_real *noise = information + squares(rls->entries);
    const hd_estimate estimate = {
        rls->unit, rls->forgetting, coefficients, information, noise, noise + 6, noise + 12,
    };

    return estimate;
}

static size_t estimate_size(const hd_entries *entries)
{
    size_t size = (size_t)entries->starts[6] + squares(entries) + 12;

    for (size_t i = 0; i < 6; ++i)
        size += hd_witness_size((size_t)(entries->starts[i + 1] - entries->starts[i]));
    return size;
}

size_t hd_rls_lasting(const hd_rls *rls)
{
    return before_estimate(rls) + estimate_size(rls->entries);
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
    const int is = judge(plant, sample, state);
    int moved = 0;
    hd_step step;

    if (is == LEFT_OUT)
        return 0;
    if (is == FIRST) {
        clear(block, hd_block_size(plant->n_terms));
        hd_witness_break(rls->entries, estimate.witness);
    } else {
        hd_step_between(plant, &last, sample, &step, work);
        moved = hd_block_add(plant, rls->entries->known, &step, rls->length, block, row);
        if (!are_finite(block, hd_block_size(plant->n_terms))) {
            clear(block, hd_block_size(plant->n_terms));
            hd_run_begins(state);
            return LEFT_OUT;
        }
    }
    if (moved) {
        hd_real *known = state + before_estimate(rls), *spare = state + hd_rls_lasting(rls);
        const size_t n = estimate_size(rls->entries);
        copy(spare, known, n);
        hd_absorb(rls->entries, &estimate, plant->n_terms, row, row + plant->n_terms + 6);
        if (!are_finite(known, n)) {
            copy(known, spare, n);
            hd_run_begins(state);
            return LEFT_OUT;
        }
    }
    remember(plant, sample, state);
    return 1 + moved;
}

void hd_rls_estimate(const hd_rls *rls, const hd_real *state, hd_real *coefficients)
{
    copy(coefficients, state + before_estimate(rls), (size_t)rls->entries->starts[6]);
}

/* FNV-1a, begun with a mark and with the size of a number. */
static uint32_t checksum(const unsigned char *bytes, size_t n, uint32_t mark)
{
    uint32_t sum = (UINT32_C(2166136261) ^ mark ^ (uint32_t)sizeof(hd_real)) * UINT32_C(16777619);

    for (size_t i = 0; i < n; ++i)
        sum = (sum ^ bytes[i]) * UINT32_C(16777619);
    return sum;
}

void hd_keep(const hd_real *state, size_t n, uint32_t mark, unsigned char *kept)
{
    const unsigned char *bytes = (const unsigned char *)state;
    const size_t size = n * sizeof *state;
    const uint32_t sum = checksum(bytes, size, mark);

    for (size_t i = 0; i < size; ++i)
        kept[i] = bytes[i];
    for (size_t i = 0; i < 4; ++i)
        kept[size + i] = (unsigned char)(sum >> (8 * i));
}

int hd_restore(const unsigned char *kept, size_t n, uint32_t mark, hd_real *state)
{
    const size_t size = n * sizeof *state;
    const uint32_t sum = checksum(kept, size, mark);
    unsigned char *bytes = (unsigned char *)state;

    for (size_t i = 0; i < 4; ++i)
        if (kept[size + i] != (unsigned char)(sum >> (8 * i)))
            return 0;
    for (size_t i = 0; i < size; ++i)
        bytes[i] = kept[i];
    return 1;
}
