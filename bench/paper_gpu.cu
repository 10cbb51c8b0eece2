// The GPU's side of bench/paper: bandwidth of copies, sums (by a kernel of our own and by CUB), boxes by
// layout and with the upload in streams, and sweeps of a table in constant, global and shared memory. One
// JSON object a line for every measurement; exit code 1 when a result is wrong. Needs a GPU and its driver,
// nothing else.
//
//     paper_gpu [copy] [sum] [boxes] [table] [--quick] [--runs N] [--meshes DIR]
//
// "time" of a row: `device`, kernels alone by the GPU's clock, many in a row; `call`, by the host's clock
// from the first launch until the result is on the host; `upload`, that and before it the data from the
// host's pinned memory; `upload, pageable`, the same from memory that the driver has to copy first.
#include "paper_kernels.h"
#include "paper_rows.h"

#include <cub/device/device_reduce.cuh>

using namespace paper;

namespace {

constexpr unsigned kThreads = 256;

void check(cudaError_t error, const char* what) {
    if (error != cudaSuccess)
        throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(error));
}

/// Memory of the GPU.
template <typename T>
class DeviceArray {
public:
    explicit DeviceArray(std::size_t count) : count_(count) {
        check(cudaMalloc(&data_, std::max<std::size_t>(1, count) * sizeof(T)), "cudaMalloc");
        check(cudaMemset(data_, 0, count * sizeof(T)), "cudaMemset");
    }
    explicit DeviceArray(const std::vector<T>& values) : DeviceArray(values.size()) {
        check(cudaMemcpy(data_, values.data(), count_ * sizeof(T), cudaMemcpyHostToDevice), "upload");
    }
    ~DeviceArray() { cudaFree(data_); }
    DeviceArray(const DeviceArray&) = delete;
    DeviceArray& operator=(const DeviceArray&) = delete;
    T* get() const { return data_; }
    std::vector<T> read() const {
        std::vector<T> values(count_);
        check(cudaMemcpy(values.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost), "download");
        return values;
    }

private:
    std::size_t count_;
    T* data_ = nullptr;
};

/// Memory of the host that the GPU reads and writes by itself.
class PinnedArray {
public:
    explicit PinnedArray(std::size_t count) {
        check(cudaMallocHost(&data_, count * sizeof(float)), "pinning");
    }
    ~PinnedArray() { cudaFreeHost(data_); }
    PinnedArray(const PinnedArray&) = delete;
    PinnedArray& operator=(const PinnedArray&) = delete;
    float* get() const { return data_; }

private:
    float* data_ = nullptr;
};

class Stream {
public:
    Stream() { check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate"); }
    ~Stream() { cudaStreamDestroy(stream_); }
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;
    operator cudaStream_t() const { return stream_; }

private:
    cudaStream_t stream_ = nullptr;
};

/// Seconds of one of several launches in a row of at least 2 ms, by the GPU's clock.
template <typename Launch>
std::vector<double> timedOnDevice(int runs, const Launch& launch) {
    cudaEvent_t begin, end;
    check(cudaEventCreate(&begin), "cudaEventCreate");
    check(cudaEventCreate(&end), "cudaEventCreate");
    const auto row = [&](int launches) {
        check(cudaEventRecord(begin), "cudaEventRecord");
        for (int i = 0; i < launches; ++i) launch();
        check(cudaEventRecord(end), "cudaEventRecord");
        check(cudaEventSynchronize(end), "the kernels");
        check(cudaGetLastError(), "a launch");
        float milliseconds = 0;
        check(cudaEventElapsedTime(&milliseconds, begin, end), "cudaEventElapsedTime");
        return milliseconds * 1e-3;
    };
    row(1);
    const double once = row(3) / 3;
    const int launches = static_cast<int>(std::min(1000.0, 2e-3 / std::max(once, 1e-7) + 1));
    row(launches);
    std::vector<double> seconds;
    for (int i = 0; i < runs; ++i) seconds.push_back(row(launches) / launches);
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    return seconds;
}

/// The blocks of a kernel that the GPU holds at once, and no more than there are groups of numbers.
template <typename Kernel>
unsigned gridFor(Kernel kernel, std::size_t groups, const cudaDeviceProp& device) {
    int blocks = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kThreads, 0), "occupancy");
    const std::size_t most = std::size_t(std::max(1, blocks)) * device.multiProcessorCount;
    return static_cast<unsigned>(std::clamp<std::size_t>((groups + kThreads - 1) / kThreads, 1, most));
}

bool copies(const Options& options, const cudaDeviceProp& device) {
    const std::size_t count = options.quick ? 1 << 20 : 100'000'000, bytes = count * sizeof(float);
    const DeviceArray<float> from(std::vector<float>(count, 1.0f)), to(count);
    const auto print = [&](const char* method, const std::vector<double>& seconds) {
        Row("copy", "gpu", method)
            .word("time", "device")
            .number("n", static_cast<double>(count))
            .number("bytes", 2.0 * bytes)
            .seconds(seconds)
            .print();
    };
    print("cudaMemcpy", timedOnDevice(options.runs, [&] {
              check(cudaMemcpyAsync(to.get(), from.get(), bytes, cudaMemcpyDeviceToDevice), "cudaMemcpy");
          }));
    const unsigned blocks = gridFor(copyKernel, count / 4, device);
    print("kernel", timedOnDevice(options.runs, [&] {
              copyKernel<<<blocks, kThreads>>>(reinterpret_cast<const float4*>(from.get()),
                                               reinterpret_cast<float4*>(to.get()), count / 4);
          }));
    const bool right = to.read() == from.read();
    const PinnedArray pinned(count);
    std::fill(pinned.get(), pinned.get() + count, 2.0f);
    const auto seconds = timed(options.runs, [&] {
        check(cudaMemcpy(to.get(), pinned.get(), bytes, cudaMemcpyHostToDevice), "upload");
    });
    Row("copy", "gpu", "upload, pinned")
        .word("time", "call")
        .number("n", static_cast<double>(count))
        .number("bytes", static_cast<double>(bytes))
        .truth("right", right)
        .seconds(seconds)
        .print();
    return right;
}

bool sums(const Options& options, const cudaDeviceProp& device) {
    Threads makers(std::thread::hardware_concurrency());
    bool right = true;
    for (const std::size_t count : sumCounts(options)) {
        const std::vector<float> values = numbers(count, makers);
        const double exact = exactSum(values.data(), count);
        const DeviceArray<float> data(values), result(1), of_blocks(1 << 16);
        const DeviceArray<unsigned> arrived(1);
        const PinnedArray answer(1), pinned(count);
        std::copy(values.begin(), values.end(), pinned.get());

        const unsigned blocks = gridFor(sumKernel, count / 4, device);
        const auto own = [&] {
            sumKernel<<<blocks, kThreads>>>(data.get(), count, of_blocks.get(), arrived.get(),
                                            result.get());
        };
        std::size_t bytes = 0;
        const int items = static_cast<int>(count);
        check(cub::DeviceReduce::Sum(nullptr, bytes, data.get(), result.get(), items), "CUB");
        const DeviceArray<unsigned char> scratch(bytes);
        const auto cub = [&] {
            check(cub::DeviceReduce::Sum(scratch.get(), bytes, data.get(), result.get(), items), "CUB");
        };
        // CUB says nothing of its order; as if there were 256 threads a multiprocessor, each with one sum.
        const double of_cub = std::ceil(double(count) / (256.0 * device.multiProcessorCount)) + 64;
        const auto measure = [&](const char* method, double additions, const auto& launch) {
            const auto fetch = [&] {
                check(cudaMemcpy(answer.get(), result.get(), sizeof(float), cudaMemcpyDeviceToHost),
                      "result");
                return double{*answer.get()};
            };
            const auto print = [&](const char* time, const std::vector<double>& seconds) {
                right = printSum("gpu", method, time, count, fetch(), exact, additions, seconds) && right;
                check(cudaMemset(result.get(), 0, sizeof(float)), "cudaMemset");
            };
            print("device", timedOnDevice(options.runs, launch));
            print("call", timed(options.runs, [&] {
                      launch();
                      fetch();
                  }));
            const auto uploaded = [&](const float* from) {
                return timed(options.runs, [&] {
                    check(cudaMemcpyAsync(data.get(), from, count * sizeof(float), cudaMemcpyHostToDevice),
                          "upload");
                    launch();
                    fetch();
                });
            };
            print("upload", uploaded(pinned.get()));
            print("upload, pageable", uploaded(values.data()));
        };
        measure("own", sumAdditions(count, blocks, kThreads), own);
        measure("cub", of_cub, cub);
    }
    return right;
}

/// A box in parts, each with its upload: part k in stream k modulo the number of streams.
class BoxInParts {
public:
    BoxInParts(std::size_t points, unsigned parts, unsigned streams, const cudaDeviceProp& device)
        : points_(points),
          parts_(parts),
          streams_(streams),
          data_(3 * points),
          blocks_(gridFor(boxKernel<PointsAosWide>, points / 4 / parts, device)),
          of_blocks_(std::size_t{6} * blocks_ * parts),
          arrived_(parts),
          results_(6 * parts),
          answers_(6 * parts) {
        check(cudaDeviceSynchronize(), "clearing memory");  // The streams do not wait for it.
    }

    /// Of points on the host, a multiple of 4.
    Box boxOf(const float* points) {
        for (unsigned k = 0; k < parts_; ++k) {
            const std::size_t begin = 4 * partBegin(points_ / 4, k, parts_);
            const std::size_t count = 4 * partBegin(points_ / 4, k + 1, parts_) - begin;
            if (count == 0) throw std::runtime_error("a part of a mesh has no points");
            const cudaStream_t stream = streams_[k % streams_.size()];
            check(cudaMemcpyAsync(data_.get() + 3 * begin, points + 3 * begin, 12 * count,
                                  cudaMemcpyHostToDevice, stream),
                  "upload");
            boxKernel<PointsAosWide><<<blocks_, kThreads, 0, stream>>>(
                data_.get() + 3 * begin, count, 0, of_blocks_.get() + std::size_t{6} * blocks_ * k,
                arrived_.get() + k, results_.get() + 6 * k);
            check(cudaMemcpyAsync(answers_.get() + 6 * k, results_.get() + 6 * k, 6 * sizeof(float),
                                  cudaMemcpyDeviceToHost, stream),
                  "result");
        }
        Box box = emptyBox();
        for (const Stream& stream : streams_) check(cudaStreamSynchronize(stream), "a stream");
        for (unsigned k = 0; k < parts_; ++k) {
            Box of_part;
            std::copy(answers_.get() + 6 * k, answers_.get() + 6 * k + 6, of_part.bounds);
            join(box, of_part);
        }
        return box;
    }

private:
    std::size_t points_;
    unsigned parts_;
    std::vector<Stream> streams_;
    DeviceArray<float> data_;
    unsigned blocks_;
    DeviceArray<float> of_blocks_;
    DeviceArray<unsigned> arrived_;
    DeviceArray<float> results_;
    PinnedArray answers_;
};

bool boxes(const Options& options, const cudaDeviceProp& device) {
    Threads makers(std::thread::hardware_concurrency());
    bool right = true;
    for (Cloud& cloud : clouds(options, makers)) {
        const double triangles = static_cast<double>(cloud.points.size() / 9);
        const Box expected = boxOfPoints(cloud.points.data(), cloud.points.size() / 3);
        while (cloud.points.size() % 12 != 0) cloud.points.push_back(cloud.points[cloud.points.size() - 3]);
        const std::size_t count = cloud.points.size() / 3;
        const auto print = [&](const char* method, const char* layout, const char* time, const Box& box,
                               const std::vector<double>& seconds) {
            Row("box", "gpu", method)
                .word("mesh", cloud.name)
                .word("layout", layout)
                .word("time", time)
                .number("triangles", triangles)
                .truth("right", box == expected)
                .seconds(seconds)
                .print();
            right = right && box == expected;
        };
        {
            const DeviceArray<float> aos(cloud.points), soa(asArrays(cloud.points)), of_blocks(1 << 16);
            const DeviceArray<float> result(6);
            const DeviceArray<unsigned> arrived(1);
            const auto measure = [&](auto points, const char* layout, const DeviceArray<float>& data) {
                using Points = decltype(points);
                const unsigned blocks = gridFor(boxKernel<Points>, count / Points::kAtOnce, device);
                const auto launch = [&] {
                    boxKernel<Points><<<blocks, kThreads>>>(data.get(), count, count, of_blocks.get(),
                                                            arrived.get(), result.get());
                };
                Box box = emptyBox();
                const auto fetch = [&] {
                    check(cudaMemcpy(box.bounds, result.get(), sizeof box.bounds, cudaMemcpyDeviceToHost),
                          "result");
                };
                const auto alone = timedOnDevice(options.runs, launch);
                fetch();
                print("there", layout, "device", box, alone);
                const auto called = timed(options.runs, [&] {
                    launch();
                    fetch();
                });
                print("there", layout, "call", box, called);
                check(cudaMemset(result.get(), 0, sizeof box.bounds), "cudaMemset");
            };
            measure(PointsAos{}, "aos", aos);
            measure(PointsAosWide{}, "aos, wide", aos);
            measure(PointsSoa{}, "soa", soa);
            measure(PointsSoaWide{}, "soa, wide", soa);
        }
        const PinnedArray pinned(cloud.points.size());
        std::copy(cloud.points.begin(), cloud.points.end(), pinned.get());
        // Parts of 8 MiB, as far as 16 of them go, so that the first kernel begins early.
        const unsigned parts = std::clamp<unsigned>(static_cast<unsigned>((12 * count) >> 23), 4, 16);
        const auto measure = [&](const char* method, const char* time, unsigned in_parts, unsigned streams,
                                 const float* points) {
            BoxInParts work(count, in_parts, streams, device);
            Box box = emptyBox();
            const auto seconds = timed(options.runs, [&] { box = work.boxOf(points); });
            print(method, "aos, wide", time, box, seconds);
        };
        measure("one stream", "upload", 1, 1, pinned.get());
        measure("one stream", "upload, pageable", 1, 1, cloud.points.data());
        measure("four streams", "upload", parts, 4, pinned.get());
    }
    return right;
}

bool table(const Options& options) {
    const std::vector<float> corners = cornersOf(options.meshes + "/sphere.obj");
    const std::uint32_t rays = options.quick ? 1u << 12 : 1u << 20, checked = 1u << 12;
    const unsigned blocks = (rays + kThreads - 1) / kThreads;
    Threads makers(std::thread::hardware_concurrency());
    const DeviceArray<std::uint32_t> nearest(rays);
    bool right = true;
    for (const std::uint32_t triangles : kTableSizes) {
        const std::vector<float> host = tableOf(corners, triangles);
        std::vector<std::uint32_t> expected(checked), all;
        sweepOnHost(checked, triangles, TableFetch{host.data()}, expected.data(), makers);
        const DeviceArray<float> aos(host), soa(tableAsArrays(host));
        const float4* fours = reinterpret_cast<const float4*>(aos.get());
        check(cudaMemcpyToSymbol(constant_table, host.data(), host.size() * sizeof(float)),
              "constant memory");
        const auto measure = [&](const char* method, const char* layout, const auto& launch) {
            check(cudaMemset(nearest.get(), 0xff, rays * sizeof(std::uint32_t)), "cudaMemset");
            const auto seconds = timedOnDevice(options.runs, launch);
            const std::vector<std::uint32_t> found = nearest.read();
            if (all.empty()) all = found;
            const bool same = found == all && std::equal(expected.begin(), expected.end(), found.begin());
            right = right && same;
            Row("table", "gpu", method)
                .word("layout", layout)
                .word("time", "device")
                .number("triangles", triangles)
                .number("rays", rays)
                .truth("right", same)
                .seconds(seconds)
                .print();
        };
        measure("constant", "aos", [&] {
            sweepKernel<<<blocks, kThreads>>>(FetchConstant{}, triangles, rays, nearest.get());
        });
        measure("global", "aos", [&] {
            sweepKernel<<<blocks, kThreads>>>(FetchGlobal{fours}, triangles, rays, nearest.get());
        });
        measure("global", "soa", [&] {
            sweepKernel<<<blocks, kThreads>>>(FetchGlobalArrays{soa.get(), triangles}, triangles, rays,
                                              nearest.get());
        });
        measure("shared", "aos", [&] {
            if (triangles <= 64)
                sweepSharedKernel<64><<<blocks, kThreads>>>(fours, triangles, rays, nearest.get());
            else
                sweepSharedKernel<1024><<<blocks, kThreads>>>(fours, triangles, rays, nearest.get());
        });
    }
    return right;
}

}  // namespace

int main(int argc, char** argv) {
    return reported("paper_gpu", [&] {
        const Options options = optionsOf(argc, argv, {"copy", "sum", "boxes", "table"});
        check(cudaSetDevice(0), "no GPU can be used");
        cudaDeviceProp device;
        check(cudaGetDeviceProperties(&device, 0), "cudaGetDeviceProperties");
        int driver = 0, runtime = 0;
        check(cudaDriverGetVersion(&driver), "cudaDriverGetVersion");
        check(cudaRuntimeGetVersion(&runtime), "cudaRuntimeGetVersion");
        Row("device", "gpu", device.name)
            .number("multiprocessors", device.multiProcessorCount)
            .number("l2_bytes", device.l2CacheSize)
            .number("driver_knows_cuda", driver)
            .number("compiled_with_cuda", runtime)
            .print();
        bool right = true;
        if (options.has("copy")) right = copies(options, device) && right;
        if (options.has("sum")) right = sums(options, device) && right;
        if (options.has("boxes")) right = boxes(options, device) && right;
        if (options.has("table")) right = table(options) && right;
        return right;
    });
}
