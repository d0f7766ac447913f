// The doors of the robust identifier and of recursive least squares.
#include "arrays.hpp"

namespace {

using VectorAny = Array<double, -1>;
using Index = Array<const int64_t, -1>;

// Where the coefficients stand, and the table of those that do not move.
struct Entries {
    Index starts;
    Index rows;
    Rows6 known;
    hd_entries c;

    Entries(Index starts_, Index rows_, Rows6 known_)
        : starts(std::move(starts_)), rows(std::move(rows_)), known(std::move(known_)),
          c{starts.data(), rows.data(), known.data()}
    {
        require(starts.shape(0) == 7 && starts.data()[0] == 0 &&
                    starts.data()[6] == static_cast<int64_t>(rows.shape(0)),
                "starts must lead from 0 to the number of coefficients");
        for (size_t i = 0; i < 6; ++i)
            require(starts.data()[i] <= starts.data()[i + 1], "starts must not fall");
        for (size_t e = 0; e < rows.shape(0); ++e)
            require(0 <= rows.data()[e] &&
                        rows.data()[e] < static_cast<int64_t>(known.shape(0)),
                    "a coefficient must have a row of the table");
    }
    size_t n() const { return rows.shape(0); }
    void fits(const Plant &plant) const { plant.fits(known); }
    template <typename T> void one_each(const Array<T, -1> &values) const
    {
        require(values.shape(0) == n(), "one number a coefficient");
    }
    template <typename T> void matrices(const Array<T, -1> &values) const
    {
        require(values.shape(0) == hd_entries_squares(&c), "one square matrix an axis");
    }
};

struct Robust {
    Vector6 a;
    Vector gains, rest, lower, upper;
    hd_robust c;

    Robust(const Entries &entries, Vector6 a_, Vector gains_, Vector rest_, Vector lower_,
           Vector upper_, double leakage, double dead_zone)
        : a(std::move(a_)), gains(std::move(gains_)), rest(std::move(rest_)),
          lower(std::move(lower_)), upper(std::move(upper_)),
          c{a.data(),     gains.data(), rest.data(), lower.data(),
            upper.data(), leakage,      dead_zone}
    {
        entries.matrices(gains);
        for (const Vector *values : {&rest, &lower, &upper})
            entries.one_each(*values);
    }
};

hd_adapting adapting(const Entries &entries, const VectorAny &coefficients,
                     const VectorOut &error, const VectorAny &sum, const VectorAny &duration)
{
    entries.one_each(coefficients);
    entries.one_each(sum);
    require(duration.shape(0) == 1, "one duration");
    return {coefficients.data(), error.data(), sum.data(), duration.data()};
}

void check_history(const Entries &entries, const Segments &segments, size_t every,
                   const VectorAny &time, const RowsOut &errors,
                   const Array<double, -1, -1> &rows)
{
    size_t steps = 0;
    for (size_t s = 0; s < segments.shape(0); ++s)
        steps += static_cast<size_t>(segments.data()[2 * s + 1] - segments.data()[2 * s] - 1);
    const size_t stored = every ? steps / every : 0;
    require(time.shape(0) == stored && errors.shape(0) == stored && rows.shape(0) == stored &&
                rows.shape(1) == entries.n(),
            "the history must have one row a stored step");
}

void check_samples(const Plant &plant, const Vector &previous, const Vector &current)
{
    const size_t length = 18 + plant.c.n_channels;
    require(previous.shape(0) == length && current.shape(0) == length,
            "plant and sample differ in channels");
}

void robust_step(const Plant &plant, const Entries &entries, const Robust &robust,
                 const VectorAny &coefficients, const VectorOut &error, const VectorAny &sum,
                 const VectorAny &duration, const Vector &previous, const Vector &current)
{
    entries.fits(plant);
    entries.matrices(robust.gains);
    check_samples(plant, previous, current);
    const hd_adapting moving = adapting(entries, coefficients, error, sum, duration);
    const hd_sample first = unpacked(previous.data()), last = unpacked(current.data());
    Work work(hd_robust_work(&entries.c, plant.c.n_terms, plant.c.n_channels));
    hd_robust_step(&plant.c, &entries.c, &robust.c, &moving, &first, &last, work.data());
}

void robust_run(const Plant &plant, const Entries &entries, const Robust &robust,
                const VectorAny &coefficients, const VectorOut &error, const VectorAny &sum,
                const VectorAny &duration, size_t from, const Record &record,
                const Segments &segments, size_t every, const VectorAny &time,
                const RowsOut &errors, const Array<double, -1, -1> &rows)
{
    entries.fits(plant);
    entries.matrices(robust.gains);
    check_run(plant, record, segments, 0);
    check_history(entries, segments, every, time, errors, rows);
    const hd_adapting moving = adapting(entries, coefficients, error, sum, duration);
    const hd_history history{every, time.data(), errors.data(), rows.data()};
    Work work(hd_robust_work(&entries.c, plant.c.n_terms, plant.c.n_channels));
    hd_robust_run(&plant.c, &entries.c, &robust.c, &moving, from, &record.c, segments.data(),
                  segments.shape(0), &history, work.data());
}

hd_estimate estimate(const Entries &entries, const Vector &unit, double forgetting,
                     const VectorAny &coefficients, const VectorAny &information,
                     const VectorOut &noise, const VectorOut &rows)
{
    entries.one_each(unit);
    entries.one_each(coefficients);
    entries.matrices(information);
    return {unit.data(),        forgetting,   coefficients.data(),
            information.data(), noise.data(), rows.data()};
}

bool block_step(const Plant &plant, const Entries &entries, double length,
                const VectorAny &block, const VectorAny &row, const Vector &previous,
                const Vector &current)
{
    entries.fits(plant);
    check_samples(plant, previous, current);
    require(block.shape(0) == hd_block_size(plant.c.n_terms) &&
                row.shape(0) == plant.c.n_terms + 6,
            "block and row must have the plant's size");
    const hd_sample first = unpacked(previous.data()), last = unpacked(current.data());
    Work work(hd_walk_work(plant.c.n_terms, plant.c.n_channels));
    return hd_block_step(&plant.c, &entries.c, length, block.data(), row.data(), &first, &last,
                         work.data()) != 0;
}

void absorb(const Entries &entries, const Vector &unit, double forgetting,
            const VectorAny &coefficients, const VectorAny &information, const VectorOut &noise,
            const VectorOut &rows, const Vector &row)
{
    const size_t n_terms = entries.known.shape(0);
    require(row.shape(0) == n_terms + 6, "a row has the terms and six axes");
    const hd_estimate found =
        estimate(entries, unit, forgetting, coefficients, information, noise, rows);
    Work work(hd_absorb_work(&entries.c));
    hd_absorb(&entries.c, &found, n_terms, row.data(), work.data());
}

void recur(const Plant &plant, const Entries &entries, const Vector &unit, double forgetting,
           const VectorAny &coefficients, const VectorAny &information, const VectorOut &noise,
           const VectorOut &rows, double length, const VectorAny &block, const Record &record,
           const Segments &segments, size_t every, const VectorAny &time, const RowsOut &noises,
           const Array<double, -1, -1> &tables)
{
    entries.fits(plant);
    check_run(plant, record, segments, 0);
    check_history(entries, segments, every, time, noises, tables);
    require(block.shape(0) == hd_block_size(plant.c.n_terms), "a block must have its size");
    const hd_estimate found =
        estimate(entries, unit, forgetting, coefficients, information, noise, rows);
    const hd_history history{every, time.data(), noises.data(), tables.data()};
    Work work(hd_recur_work(&entries.c, plant.c.n_terms, plant.c.n_channels));
    hd_recur(&plant.c, &entries.c, &found, length, block.data(), &record.c, segments.data(),
             segments.shape(0), &history, work.data());
}

} // namespace

void add_estimators(nb::module_ &module)
{
    using Released = nb::call_guard<nb::gil_scoped_release>;

    nb::class_<Entries>(module, "Entries").def(nb::init<Index, Index, Rows6>());
    nb::class_<Robust>(module, "Robust")
        .def(nb::init<const Entries &, Vector6, Vector, Vector, Vector, Vector, double, double>());
    module.def("robust_step", &robust_step);
    module.def("robust_run", &robust_run, Released());
    module.def("block_step", &block_step);
    module.def("absorb", &absorb);
    module.def("recur", &recur, Released());
}
