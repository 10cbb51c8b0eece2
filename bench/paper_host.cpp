// The processor's side of bench/paper: sums, boxes and sweeps of a table, in one thread and in all. One
// JSON object a line for every measurement; exit code 1 when a result is wrong.
//
//     paper_host [sum] [boxes] [table] [--quick] [--runs N] [--meshes DIR]
#include "paper_rows.h"

using namespace paper;

namespace {

/// Once in one thread and once in all.
template <typename Each>
bool withThreads(const Each& each) {
    Threads one(1), all(std::thread::hardware_concurrency());
    bool right = each(one, "one thread");
    if (all.count() > 1) right = each(all, "all threads") && right;
    return right;
}

bool sums(const Options& options) {
    Threads makers(std::thread::hardware_concurrency());
    bool right = true;
    for (const std::size_t count : sumCounts(options)) {
        const std::vector<float> values = numbers(count, makers);
        const double exact = exactSum(values.data(), count);
        right = withThreads([&](Threads& threads, const char* method) {
                    double sum = 0;
                    const auto seconds =
                        timed(options.runs, [&] { sum = sumOnHost(values.data(), count, threads); });
                    return printSum("cpu", method, "call", count, sum, exact, kHostAdditions, seconds);
                }) &&
                right;
    }
    return right;
}

bool boxes(const Options& options) {
    Threads makers(std::thread::hardware_concurrency());
    bool right = true;
    for (const Cloud& cloud : clouds(options, makers)) {
        const std::size_t count = cloud.points.size() / 3;
        const Box expected = boxOfPoints(cloud.points.data(), count);
        const std::vector<float> arrays = asArrays(cloud.points);
        for (const bool as_arrays : {false, true}) {
            const float* points = as_arrays ? arrays.data() : cloud.points.data();
            right = withThreads([&](Threads& threads, const char* method) {
                        Box box = emptyBox();
                        const auto seconds = timed(
                            options.runs, [&] { box = boxOnHost(points, count, as_arrays, threads); });
                        Row("box", "cpu", method)
                            .word("mesh", cloud.name)
                            .word("layout", as_arrays ? "soa" : "aos")
                            .number("triangles", static_cast<double>(count / 3))
                            .truth("right", box == expected)
                            .seconds(seconds)
                            .print();
                        return box == expected;
                    }) &&
                    right;
        }
    }
    return right;
}

bool table(const Options& options) {
    const std::vector<float> corners = cornersOf(options.meshes + "/sphere.obj");
    const std::uint32_t rays = options.quick ? 1u << 10 : 1u << 16;
    bool right = true;
    for (const std::uint32_t triangles : kTableSizes) {
        const std::vector<float> aos = tableOf(corners, triangles), soa = tableAsArrays(aos);
        std::vector<std::uint32_t> expected(rays), nearest(rays);
        Threads one(1);
        sweepOnHost(rays, triangles, TableFetch{aos.data()}, expected.data(), one);
        const auto measure = [&](const char* layout, const auto& fetch) {
            right = withThreads([&](Threads& threads, const char* method) {
                        std::fill(nearest.begin(), nearest.end(), ~0u);
                        const auto seconds = timed(options.runs, [&] {
                            sweepOnHost(rays, triangles, fetch, nearest.data(), threads);
                        });
                        Row("table", "cpu", method)
                            .word("layout", layout)
                            .number("triangles", triangles)
                            .number("rays", rays)
                            .truth("right", nearest == expected)
                            .seconds(seconds)
                            .print();
                        return nearest == expected;
                    }) &&
                    right;
        };
        measure("aos", TableFetch{aos.data()});
        measure("soa", ArraysFetch{soa.data(), triangles});
    }
    return right;
}

}  // namespace

int main(int argc, char** argv) {
    return reported("paper_host", [&] {
        const Options options = optionsOf(argc, argv, {"sum", "boxes", "table"});
        bool right = true;
        if (options.has("sum")) right = sums(options) && right;
        if (options.has("boxes")) right = boxes(options) && right;
        if (options.has("table")) right = table(options) && right;
        return right;
    });
}
