/* The implicit midpoint rule's averages over the step between two samples.
 *
 * Velocity, attitude and a recorded wrench are averaged over a step; channels and the
 * propeller's speed keep the value they have where it begins.
 */
#include "onboard.h"

hd_sample hd_unpacked(const hd_real *values, hd_real length)
{
    const hd_sample sample = {
        length, values + 1, values + 7, values + 10, values + HD_PACKED, values[16], values[17],
    };

    return sample;
}

size_t hd_step_work(size_t n_terms, size_t n_channels)
{
    return hd_atom_count(n_channels) + 3 * n_terms;
}

void hd_end_at(const hd_plant *plant, const hd_sample *sample, const hd_real *channels,
               hd_real propulsion_speed, hd_real *atoms, hd_end *end)
{
    for (size_t i = 0; i < 6; ++i)
        end->velocity[i] = plant->free_axes[i] ? sample->velocity[i] : 0;
    hd_atoms(end->velocity, sample->down, channels, plant->n_channels, propulsion_speed, atoms, 1);
    hd_terms(plant->factors, plant->n_terms, atoms, end->xi);
    hd_coriolis(plant->mass, end->velocity, end->known);
    for (size_t i = 0; i < 6; ++i)
        end->known[i] += sample->wrench[i];
}

void hd_between(const hd_plant *plant, const hd_end *first, const hd_end *second, hd_real length,
                hd_step *step)
{
    const hd_real half = (hd_real)0.5;

    step->length = length;
    for (size_t i = 0; i < 6; ++i) {
        step->change[i] = second->velocity[i] - first->velocity[i];
        step->forcing[i] = half * (first->known[i] + second->known[i]);
    }
    for (size_t j = 0; j < plant->n_terms; ++j)
        step->xi[j] = half * (first->xi[j] + second->xi[j]);
}

void hd_step_between(const hd_plant *plant, const hd_sample *previous, const hd_sample *current,
                     hd_step *step, hd_real *work)
{
    hd_real *atoms = work;
    hd_end first, second;

    step->xi = work + hd_atom_count(plant->n_channels);
    first.xi = step->xi + plant->n_terms;
    second.xi = first.xi + plant->n_terms;
    hd_end_at(plant, previous, previous->channels, previous->opening, atoms, &first);
    hd_end_at(plant, current, previous->channels, current->closing, atoms, &second);
    hd_between(plant, &first, &second, current->length, step);
}
