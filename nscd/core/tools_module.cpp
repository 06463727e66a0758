// The door to Python of what is not contact dynamics: text, packing, fields, sums of impulses, people of the social force model.
#include <nanobind/stl/array.h>

#include "binding.hpp"
#include "ensemble.hpp"
#include "packing.hpp"
#include "coarse_grain.hpp"
#include "soft.hpp"
#include "impulse_sums.hpp"
#include "dump_text.hpp"

#include <utility>

namespace nscd {

namespace {

using Changed = nb::ndarray<double, nb::numpy, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

Out span_of(Changed& changed) { return {changed.data(), changed.size()}; }
std::string_view view(const nb::bytes& content) { return {content.c_str(), content.size()}; }

// (rows, width) of tables (p, 3): start, end, rows.
std::optional<Made<double, 2>> rows_of(const nb::bytes& content, const ArrayArg<std::int64_t, 2>& tables, std::int64_t width, bool binary) {
    need(tables.shape(1) == 3 && width > 0, "rows: tables (p, 3) and a width are needed");
    const std::span<const Table> those(reinterpret_cast<const Table*>(tables.data()), tables.shape(0));
    auto found = freely([&] { return (binary ? binary_rows : text_rows)(view(content), those, width); });
    if (!found) return std::nullopt;
    return give<2>(std::move(*found), width);
}

// A cell of a list: a word, a number, or None.
std::string cell_of(nb::handle cell) {
    std::string out;
    if (PyUnicode_Check(cell.ptr())) {
        Py_ssize_t size = 0;
        const char* word = PyUnicode_AsUTF8AndSize(cell.ptr(), &size);
        if (!word) throw nb::python_error();
        out.assign(word, std::size_t(size));
        need(out.find('\0') == out.npos, "a text with a null character, which CSV cannot hold");
        if (out.find_first_of(",\"\r\n") == out.npos) return out;
        for (std::size_t at = 0; (at = out.find('"', at)) != out.npos; at += 2) out.insert(at, 1, '"');
        return '"' + out + '"';
    }
    if (PyIndex_Check(cell.ptr())) return std::to_string(nb::cast<std::int64_t>(cell));
    if (!cell.is_none()) append_number(out, nb::cast<double>(cell), true);
    return out;
}

// Rows of a table as text, of columns of one length: arrays of float64 or int64, or lists of words, numbers and None.
nb::bytes table(const nb::typed<nb::list, nb::any>& columns, bool csv) {
    std::vector<Column> columns_given;
    std::size_t rows = 0;
    for (nb::handle column : columns) {
        VectorArg floats;
        IntegerArg integers;
        if (nb::try_cast(column, floats, false)) columns_given.emplace_back(In(span(floats)));
        else if (nb::try_cast(column, integers, false)) columns_given.emplace_back(std::span<const std::int64_t>(span(integers)));
        else {
            std::vector<std::string> cells;
            for (nb::handle cell : nb::cast<nb::list>(column)) cells.push_back(cell_of(cell));
            columns_given.emplace_back(std::move(cells));
        }
        const std::size_t size = std::visit([](const auto& cells) { return cells.size(); }, columns_given.back());
        if (columns_given.size() == 1) rows = size;
        need(size == rows, "columns of different lengths where one is needed");
    }
    const std::string out = freely([&] { return table_of(columns_given, rows, csv); });
    return nb::bytes(out.data(), out.size());
}

// places (m, 5): step, rows, line, offset, length; values (m, 7): time, lowest and highest x, y, z. They are taken away.
struct FrameHeads {
    Made<std::int64_t, 2> indices;
    Made<double, 2> values;
};
FrameHeads frames_of(Scan& scan) {
    std::vector<std::int64_t> integers;
    Vector values;
    for (const Scan::Frame& f : std::exchange(scan.frames, {})) {
        integers.insert(integers.end(), {f.step, f.rows, f.line, f.offset, f.length});
        values.insert(values.end(), std::begin(f.values), std::end(f.values));
    }
    return {give<2>(std::move(integers), 5), give<2>(std::move(values), 7)};
}

// Go on behind a head that was read elsewhere: of a frame whose table begins at `offset`, with time and box (7).
void begin_frame(Scan& scan, std::int64_t step, std::int64_t rows, std::int64_t line, std::int64_t offset, const VectorArg& values) {
    need(values.size() == 7 && rows >= 0, "begin: the time and six ends of the box are needed");
    Scan::Frame frame{step, rows, line, offset, 0, {}};
    std::copy(values.data(), values.data() + 7, frame.values);
    scan.frames.push_back(frame);
    scan.rows_left = rows, scan.last = step;
}

int grow_of(Changed position, const VectorArg& radius, int placed, double half_door, double cell, double reach, double typical, double reach_between,
            double beside, double wall_distance, double hollow, bool shut) {
    need(position.shape(1) == 2 && position.shape(0) == radius.size() && cell > 0.0, "grow: shapes differ");
    return grow(span_of(position), span(radius), placed, {half_door, cell, reach, typical, reach_between, beside, wall_distance, hollow, shut});
}

bool press_of(Changed position, const VectorArg& radius, const VectorArg& push, double half_door, double stiffness, double step, double longest,
              double skin, double cell, double force_tolerance, int max_steps) {
    need(position.shape(1) == 2 && position.shape(0) == radius.size() && push.size() == radius.size() && cell > 0.0, "press: shapes differ");
    return press(span_of(position), span(radius), span(push), {half_door, stiffness, step, longest, skin, cell, force_tolerance, max_steps});
}

struct Smeared {
    Made<double, 2> field, gradient;  // (m, d), (m, 2d)
};
Smeared coarse_grain_of(const MatrixArg& points, const MatrixArg& where, const MatrixArg& values, double width, double reach, bool compact) {
    need(points.shape(1) == 2 && where.shape(1) == 2 && where.shape(0) == values.shape(0), "smear: shapes differ");
    const std::size_t m = points.shape(0), d = values.shape(1);
    Vector field(m * d, 0.0), gradient(2 * m * d, 0.0);
    if (m && where.size()) freely([&] { coarse_grain(span(points), span(where), span(values), {width, reach, compact}, field, gradient); });
    return {give<2>(std::move(field), std::max<std::size_t>(d, 1)), give<2>(std::move(gradient), std::max<std::size_t>(2 * d, 1))};
}

struct SmearedStress {
    Made<double, 2> stress, divergence, traction;  // (m, 4), (m, 2), (m, 2)
};
SmearedStress smear_stress_of(const MatrixArg& points, const MatrixArg& start, const MatrixArg& branch, const MatrixArg& impulse, const MaskArg& is_wall, double width,
                     double reach, bool compact) {
    const std::size_t m = points.shape(0), k = is_wall.size();
    need(points.shape(1) == 2 && start.size() == 2 * k && branch.size() == 2 * k && impulse.size() == 2 * k, "stress: shapes differ");
    Vector stress(4 * m, 0.0), divergence(2 * m, 0.0), traction(2 * m, 0.0);
    const Loads loads{span(start), span(branch), span(impulse), span(is_wall)};
    if (m && k) freely([&] { coarse_grain_stress(span(points), loads, {width, reach, compact}, stress, divergence, traction); });
    return {give<2>(std::move(stress), 4), give<2>(std::move(divergence), 2), give<2>(std::move(traction), 2)};
}

void social_of(Changed position, Changed velocity, const MatrixArg& desired, const VectorArg& radius, const VectorArg& mass, const MatrixArg& start,
               const MatrixArg& end, const std::array<double, 4>& law, double tau, double reach, double gone, double step, int steps) {
    const std::size_t n = radius.size();
    need(position.size() == 2 * n && velocity.size() == 2 * n && desired.size() == 2 * n && mass.size() == n && start.size() == end.size(), "social: shapes differ");
    nb::gil_scoped_release others;
    social_steps(span_of(position), span_of(velocity), span(desired), span(radius), span(mass), span(start), span(end),
                 {law[0], law[1], law[2], law[3], tau, reach, gone}, step, steps);
}

void add_to_window(WindowSums& sums, const ArrayArg<Index, 1>& first, const ArrayArg<Index, 1>& second, const ArrayArg<Index, 1>& wall,
                   const MatrixArg& normal, const VectorArg& gap, const VectorArg& reaction, std::optional<VectorArg> friction) {
    const std::size_t k = reaction.size();
    need(first.size() == k && second.size() == k && wall.size() == k && normal.size() == 2 * k && gap.size() == k && (!friction || friction->size() == k), "window: shapes differ");
    sums.add(span(first), span(second), span(wall), span(normal), span(gap), span(reaction), friction ? span(*friction) : In{});
}

struct WindowImpulses {
    Made<std::int64_t, 1> first, second;  // second: n + wall for a wall
    Made<double, 2> normal;
    Made<double, 1> gap;
    Made<double, 2> impulse;
    Made<std::int64_t, 1> steps;
};
WindowImpulses close_window(WindowSums& sums) {
    const auto closed = sums.close();
    const std::size_t m = closed.size();
    std::vector<std::int64_t> first(m), second(m), steps(m);
    Vector normal(2 * m), gap(m), impulse(2 * m);
    for (std::size_t c = 0; c < m; ++c) {
        const auto& [key, sum] = closed[c];
        first[c] = key >> ID_BITS, second[c] = key & ID_MASK, steps[c] = sum.steps;
        normal[2 * c] = sum.x, normal[2 * c + 1] = sum.y, gap[c] = sum.gap;
        impulse[2 * c] = sum.px, impulse[2 * c + 1] = sum.py;
    }
    return {give(std::move(first)), give(std::move(second)), give<2>(std::move(normal), 2), give(std::move(gap)), give<2>(std::move(impulse), 2), give(std::move(steps))};
}

void add_engine_pairs(EngineSums& sums, const MatrixArg& ids, const MatrixArg& forces, double times) {
    need(ids.shape(1) == 2 && forces.size() == 2 * ids.size(), "add_pairs: ids (k, 2) and forces (k, 4) are needed");
    sums.add_pairs(span(ids), span(forces), times);
}

void add_engine_wall(EngineSums& sums, std::int64_t wall, const ArrayArg<Index, 1>& ids, const MatrixArg& rows, double times) {
    need(rows.shape(0) == ids.size() && rows.shape(1) >= 3, "add_wall: ids (n) and rows (n, 3) are needed");
    sums.add_wall(wall, span(ids), span(rows), rows.shape(1), times);
}

struct EngineImpulses {
    Made<std::int64_t, 1> first, second, is_wall;
    Made<double, 1> x, y;
};
EngineImpulses close_engine(EngineSums& sums) {
    const auto closed = sums.close();
    std::vector<std::int64_t> first, second, is_wall;
    Vector x, y;
    for (const auto& [key, sum] : closed) {
        first.push_back(key >> ID_BITS & ID_MASK), second.push_back(key & ID_MASK), is_wall.push_back(key >= EngineSums::WALL);
        x.push_back(sum.x), y.push_back(sum.y);
    }
    return {give(std::move(first)), give(std::move(second)), give(std::move(is_wall)), give(std::move(x)), give(std::move(y))};
}

struct Drawn {
    Made<double, 2> draws;  // (d, u)
    Made<double, 1> last;   // (u) x at the end
};

auto gibbs_of(const IntegerArg& start, const ArrayArg<Index, 1>& column, const VectorArg& value, double slope, const VectorArg& x, const VectorArg& net,
              std::uint64_t seed, std::int64_t sweeps, std::int64_t thin) {
    const std::size_t u = x.size();
    bool valid = u > 0 && thin > 0 && start.size() == u + 1 && start(0) == 0 && start(u) == std::int64_t(value.size()) && column.size() == value.size();
    for (std::size_t c = 0; valid && c < u; ++c) valid = start(c) <= start(c + 1);
    for (std::size_t e = 0; valid && e < column.size(); ++e) valid = column(e) >= 0 && std::size_t(column(e)) < net.size();
    need(valid, "gibbs: rows of a sparse matrix are needed");
    Vector draws, now(x.data(), x.data() + u), open(net.data(), net.data() + net.size());
    freely([&] { gibbs_sweeps({span(start), span(column), span(value)}, slope, now, open, seed, sweeps, thin, draws); });
    return Drawn(give<2>(std::move(draws), u), give(std::move(now)));
}

auto flights_of(const MatrixArg& projector, const VectorArg& gravity, double time, const VectorArg& x, std::uint64_t seed, std::int64_t count, std::int64_t thin) {
    const std::size_t u = x.size();
    need(u > 0 && thin > 0 && projector.shape(0) == u && projector.shape(1) == u && gravity.size() == u, "flights: shapes differ");
    Vector draws, now(x.data(), x.data() + u);
    freely([&] { flights(span(projector), span(gravity), time, now, seed, count, thin, draws); });
    return Drawn(give<2>(std::move(draws), u), give(std::move(now)));
}

}  // namespace

void bind_others(nb::module_& m) {
    Result<Drawn>(m, "Drawn").field("draws", &Drawn::draws).field("last", &Drawn::last);
    Result<FrameHeads>(m, "FrameHeads").field("places", &FrameHeads::indices).field("values", &FrameHeads::values);
    Result<Smeared>(m, "Smeared").field("field", &Smeared::field).field("gradient", &Smeared::gradient);
    Result<SmearedStress>(m, "SmearedStress").field("stress", &SmearedStress::stress).field("divergence", &SmearedStress::divergence)
        .field("traction", &SmearedStress::traction);
    using Window = WindowImpulses;
    Result<Window>(m, "WindowImpulses").field("first", &Window::first).field("second", &Window::second).field("normal", &Window::normal)
        .field("gap", &Window::gap).field("impulse", &Window::impulse).field("steps", &Window::steps);
    using Engine = EngineImpulses;
    Result<Engine>(m, "EngineImpulses").field("first", &Engine::first).field("second", &Engine::second).field("is_wall", &Engine::is_wall)
        .field("x", &Engine::x).field("y", &Engine::y);
    m.def("gibbs", &gibbs_of, "start"_n, "column"_n, "value"_n, "slope"_a, "x"_n, "net"_n, "seed"_a, "sweeps"_a, "thin"_a);
    m.def("flights", &flights_of, "projector"_n, "gravity"_n, "time"_a, "x"_n, "seed"_a, "count"_a, "thin"_a);
    m.def("rows", &rows_of, "content"_a, "tables"_n, "width"_a, "binary"_a = false);
    m.def("table", &table, "columns"_a, "csv"_a);
    nb::class_<Scan> scan(m, "Scan");
    nb::enum_<Scan::End>(scan, "End").value("MORE", Scan::MORE).value("STRANGE", Scan::STRANGE).value("SHORT", Scan::SHORT);
    scan.def(nb::init<>())
        .def("run", [](Scan& of, const nb::bytes& block, std::int64_t before, const nb::bytes& form, std::int64_t width) {
            return of.run(view(block), before, view(form), width);
        }, "block"_a, "before"_a, "form"_a, "width"_a)
        .def("begin", &begin_frame, "step"_a, "rows"_a, "line"_a, "offset"_a, "values"_n)
        .def("take", &frames_of)
        .def("__len__", [](const Scan& of) { return of.frames.size(); })
        .def_rw("at", &Scan::at).def_rw("lines", &Scan::lines).def_ro("rows_left", &Scan::rows_left).def_ro("last", &Scan::last);
    m.def("grow", &grow_of, "position"_n, "radius"_n, "placed"_a, "half_door"_a, "cell"_a, "reach"_a, "typical"_a,
          "reach_between"_a, "beside"_a, "wall_distance"_a, "hollow"_a, "shut"_a);
    m.def("press", &press_of, "position"_n, "radius"_n, "push"_n, "half_door"_a, "stiffness"_a, "step"_a,
          "longest"_a, "skin"_a, "cell"_a, "force_tolerance"_a, "max_steps"_a);
    m.def("coarse_grain", &coarse_grain_of, "points"_n, "where"_n, "values"_n, "width"_a, "reach"_a, "compact"_a);
    m.def("coarse_grain_stress", &smear_stress_of, "points"_n, "start"_n, "branch"_n, "impulse"_n, "is_wall"_n, "width"_a, "reach"_a, "compact"_a);
    m.def("social_steps", &social_of, "position"_n, "velocity"_n, "desired"_n, "radius"_n,
          "mass"_n, "start"_n, "end"_n, "law"_a, "tau"_a, "reach"_a, "gone"_a, "step"_a, "steps"_a);
    nb::class_<WindowSums>(m, "WindowSums")
        .def(nb::init<std::int64_t>(), "n"_a)
        .def("add", &add_to_window, "first"_n, "second"_n, "wall"_n, "normal"_n, "gap"_n, "reaction"_n, "friction"_n = nb::none())
        .def("close", &close_window);
    nb::class_<EngineSums>(m, "EngineSums")
        .def(nb::init<>())
        .def("add_pairs", &add_engine_pairs, "ids"_n, "forces"_n, "times"_a)
        .def("add_wall", &add_engine_wall, "wall"_a, "ids"_n, "rows"_n, "times"_a)
        .def("close", &close_engine);
}

}  // namespace nscd
