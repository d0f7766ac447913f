/* From samples to steps: what the implicit midpoint rule needs between two samples.
 *
 * Velocity, attitude and a recorded wrench are averaged over a step; channels and the
 * propeller's speed keep the value they have where it begins.
 */
#include "batch.h"

size_t hd_walk_work(size_t n_terms, size_t n_channels)
{
    return hd_atom_count(n_channels) + 3 * n_terms;
}

static void evaluate(const hd_plant *plant, const hd_sample *sample, const hd_real *channels,
                     hd_real propulsion_speed, hd_real *atoms, hd_end *at)
{
    for (size_t i = 0; i < 6; ++i)
        at->velocity[i] = plant->free_axes[i] ? sample->velocity[i] : 0;
    hd_atoms(at->velocity, sample->down, channels, plant->n_channels, propulsion_speed, atoms, 1);
    hd_terms(plant->factors, plant->n_terms, atoms, at->xi);
    hd_coriolis(plant->mass, at->velocity, at->known);
    for (size_t i = 0; i < 6; ++i)
        at->known[i] += sample->wrench[i];
}

/* Whether the step after `sample` holds what was held up to it, so that its values there
 * need no second evaluation. */
static int holds_on(const hd_plant *plant, const hd_sample *before, const hd_sample *sample)
{
    for (size_t i = 0; i < plant->n_channels; ++i)
        if (!(before->channels[i] == sample->channels[i]))
            return 0;
    return sample->closing == sample->opening;
}

void hd_walk_from(const hd_plant *plant, const hd_sample *first, hd_walk *walk, hd_real *work)
{
    walk->last = *first;
    walk->fresh = 0;
    walk->atoms = work;
    walk->ends[0].xi = work + hd_atom_count(plant->n_channels);
    walk->ends[1].xi = walk->ends[0].xi + plant->n_terms;
    walk->step.xi = walk->ends[1].xi + plant->n_terms;
}

void hd_walk_to(const hd_plant *plant, const hd_sample *sample, hd_walk *walk)
{
    const hd_real half = (hd_real)0.5;
    const hd_sample *last = &walk->last;
    hd_end *first = &walk->ends[0], *second = &walk->ends[1];
    hd_step *step = &walk->step;

    if (!walk->fresh)
        evaluate(plant, last, last->channels, last->opening, walk->atoms, first);
    evaluate(plant, sample, last->channels, sample->closing, walk->atoms, second);
    step->length = sample->time - last->time;
    for (size_t i = 0; i < 6; ++i) {
        step->change[i] = second->velocity[i] - first->velocity[i];
        step->forcing[i] = half * (first->known[i] + second->known[i]);
    }
    for (size_t j = 0; j < plant->n_terms; ++j)
        step->xi[j] = half * (first->xi[j] + second->xi[j]);
    const hd_end swapped = *first;
    *first = *second;
    *second = swapped;
    walk->fresh = holds_on(plant, last, sample);
    walk->last = *sample;
}

hd_sample hd_sample_at(const hd_record *record, size_t k)
{
    const hd_sample sample = {
        record->time[k],           record->velocity + 6 * k,
        record->down + 3 * k,      record->wrench + 6 * k,
        record->channels + record->n_channels * k,
        record->propulsion[2 * k], record->propulsion[2 * k + 1],
    };

    return sample;
}

/* Replace the rows and columns of locked axes by those of the identity. */
void hd_lock(const unsigned char free_axes[6], hd_real left[36], hd_real right[6])
{
    for (size_t i = 0; i < 6; ++i) {
        if (free_axes[i])
            continue;
        for (size_t k = 0; k < 6; ++k)
            left[6 * i + k] = left[6 * k + i] = 0;
        left[7 * i] = 1;
        right[i] = 0;
    }
}
