// The doors of the C99 core: arrays in, arrays filled. Workspaces are allocated here, because
// C does not. Batches release the GIL.
#include "arrays.hpp"

void add_estimators(nb::module_ &module); // estimators.cpp

namespace {

const double *data_or_null(const Rows4 &attitude)
{
    return attitude.shape(0) ? attitude.data() : nullptr;
}

void regressor(const Factors &factors, const Rows6 &velocity,
               const Rows3 &down, const Table &channels,
               const Vector &propulsion_speed,
               const nb::ndarray<double, nb::ndim<2>, nb::device::cpu> &out)
{
    const size_t n = velocity.shape(0), m = channels.shape(1);
    for (size_t i = 0; i < 4 * factors.shape(0); ++i)
        require(factors.data()[i] >= 0 &&
                    static_cast<size_t>(factors.data()[i]) < hd_atom_count(m),
                "a factor must be the number of an atom");
    require(down.shape(0) == n && channels.shape(0) == n && propulsion_speed.shape(0) == n,
            "all arrays must have one row a sample");
    require(out.shape(0) == n && out.shape(1) == factors.shape(0),
            "out must have one row a sample and one column a term");
    const hd_record record{n,           m,       nullptr,         velocity.data(),
                           down.data(), nullptr, channels.data(), nullptr};
    Work work(hd_atom_count(m) * HD_BLOCK);
    hd_regressor(factors.data(), factors.shape(0), &record, propulsion_speed.data(), out.data(),
                 out.stride(0), out.stride(1), work.data());
}

void coriolis(const Matrix6 &mass, const Rows6 &velocity,
              const RowsOut &wrench)
{
    require(velocity.shape(0) == wrench.shape(0), "one wrench a sample");
    for (size_t k = 0; k < velocity.shape(0); ++k)
        hd_coriolis(mass.data(), velocity.data() + 6 * k, wrench.data() + 6 * k);
}

void acceleration(const Plant &plant, const Rows6 &matrix, const Vector6 &velocity,
                  const Array<const double, 3> &down, const Vector6 &wrench,
                  const Vector &channels, double propulsion_speed, const VectorOut &rate)
{
    double inverse[36], moving[6];
    plant.fits(matrix);
    require(channels.shape(0) == plant.c.n_channels, "plant and sample differ in channels");
    for (size_t i = 0; i < 6; ++i)
        moving[i] = plant.c.free_axes[i] ? velocity.data()[i] : 0.0;
    Work work = plant.work();
    hd_mass_inverse(&plant.c, inverse);
    hd_acceleration(&plant.c, inverse, matrix.data(), moving, down.data(), wrench.data(),
                    channels.data(), propulsion_speed, rate.data(), work.data());
}

void replay(const Plant &plant, const Rows6 &matrix, const Record &record,
            const Segments &segments, const Rows4 &attitude, double max_step, double limit,
            const RowsOut &velocity, const Array<int64_t, -1> &diverged_at)
{
    plant.fits(matrix);
    check_run(plant, record, segments, attitude.shape(0));
    require(velocity.shape(0) == record.c.n && diverged_at.shape(0) == segments.shape(0),
            "results must have one row a sample and one entry a segment");
    Work work = plant.work();
    hd_replay(&plant.c, matrix.data(), &record.c, segments.data(), segments.shape(0),
              data_or_null(attitude), max_step, limit, velocity.data(), diverged_at.data(),
              work.data());
}

void sensitivities(const Plant &plant, const Rows6 &matrix,
                   const Array<const int32_t, -1, 2> &parameters, const Record &record,
                   const Segments &segments, const Rows4 &attitude, double max_step,
                   double limit, const RowsOut &velocity,
                   const Array<double, -1, 6, -1> &jacobian)
{
    const size_t p = parameters.shape(0);
    plant.fits(matrix);
    check_run(plant, record, segments, attitude.shape(0));
    require(velocity.shape(0) == record.c.n && jacobian.shape(0) == record.c.n &&
                jacobian.shape(2) == p + 6,
            "results must have one row a sample and one column a parameter");
    for (size_t i = 0; i < p; ++i) {
        const int32_t term = parameters.data()[2 * i], axis = parameters.data()[2 * i + 1];
        require(0 <= term && static_cast<size_t>(term) < plant.c.n_terms && 0 <= axis && axis < 6,
                "a parameter must be a place in the coefficient matrix");
    }
    Work work(hd_sensitivity_work(plant.c.n_terms, plant.c.n_channels, p));
    hd_sensitivities(&plant.c, matrix.data(), parameters.data(), p, &record.c, segments.data(),
                     segments.shape(0), data_or_null(attitude), max_step, limit, velocity.data(),
                     jacobian.data(), work.data());
}

void adapt(const Plant &plant, const Vector6 &a, const Rows6 &gamma,
           const RowsOut &matrix, const VectorOut &error, const Record &record,
           const Segments &segments, size_t passes, size_t every, const Array<double, -1> &time,
           const RowsOut &errors, const Array<double, -1, -1, 6> &matrices)
{
    size_t steps = 0;
    plant.fits(gamma);
    require(matrix.shape(0) == plant.c.n_terms, "a coefficient matrix must have one row a term");
    check_run(plant, record, segments, 0);
    for (size_t s = 0; s < segments.shape(0); ++s)
        steps += static_cast<size_t>(segments.data()[2 * s + 1] - segments.data()[2 * s] - 1);
    const size_t stored = every ? passes * steps / every : 0;
    require(time.shape(0) == stored && errors.shape(0) == stored && matrices.shape(0) == stored &&
                matrices.shape(1) == plant.c.n_terms,
            "the history must have one row a stored step");
    const hd_history history{every, time.data(), errors.data(), matrices.data()};
    Work work(hd_adapt_work(plant.c.n_terms, plant.c.n_channels));
    hd_adapt(&plant.c, a.data(), gamma.data(), matrix.data(), error.data(), &record.c,
             segments.data(), segments.shape(0), passes, &history, work.data());
}

void adapt_step(const Plant &plant, const Vector6 &a, const Rows6 &gamma,
                const RowsOut &matrix, const VectorOut &error,
                const Vector &previous, const Vector &current)
{
    const size_t length = 18 + plant.c.n_channels;
    plant.fits(gamma);
    require(matrix.shape(0) == plant.c.n_terms, "a coefficient matrix must have one row a term");
    require(previous.shape(0) == length && current.shape(0) == length,
            "plant and sample differ in channels");
    Work work(hd_adapt_work(plant.c.n_terms, plant.c.n_channels));
    const hd_sample first = unpacked(previous.data()), last = unpacked(current.data());
    hd_adapt_step(&plant.c, a.data(), gamma.data(), matrix.data(), error.data(), &first, &last,
                  work.data());
}

} // namespace

NB_MODULE(_core, module)
{
    using Released = nb::call_guard<nb::gil_scoped_release>;

    nb::class_<Plant>(module, "Plant").def(nb::init<Factors, Matrix6, Flags6, size_t>());
    nb::class_<Record>(module, "Record")
        .def(nb::init<Vector, Rows6, Rows3, Rows6, Table, Rows2>());
    module.def("regressor", &regressor, Released());
    module.def("coriolis", &coriolis, Released());
    module.def("acceleration", &acceleration);
    module.def("replay", &replay, Released());
    module.def("sensitivities", &sensitivities, Released());
    module.def("adapt", &adapt, Released());
    // Too short a call to be worth releasing the GIL; a converted copy would lose the result.
    module.def("adapt_step", &adapt_step, nb::arg("plant"), nb::arg("a"), nb::arg("gamma"),
               nb::arg("matrix").noconvert(), nb::arg("error").noconvert(), nb::arg("previous"),
               nb::arg("current"));
    add_estimators(module);
}
