/// The shared parts of bench/paper_host.cpp and bench/paper_gpu.cu: the numbers that are summed, the points
/// that are boxed, the triangles that rays are tested against, the processor's ways to do all three, how
/// runs are timed, and how a line of the output looks. Standard library only, C++17, so that nvcc and any
/// compiler take it and the programs run on machines that have nothing else.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#ifdef __CUDACC__
#define PAPER_ANYWHERE __host__ __device__
// A function for both may be given one that is only for the GPU.
#define PAPER_WHERE_ITS_ARGUMENT_IS _Pragma("nv_exec_check_disable")
#else
#define PAPER_ANYWHERE
#define PAPER_WHERE_ITS_ARGUMENT_IS
#endif

namespace paper {

/// Threads that wait for work, so that a run does not pay for starting them.
class Threads {
public:
    explicit Threads(unsigned count) : count_(std::max(1u, count)) {
        for (unsigned i = 1; i < count_; ++i) threads_.emplace_back([this, i] { serve(i); });
    }
    ~Threads() {
        {
            const std::lock_guard lock(mutex_);
            ends_ = true;
        }
        begin_.notify_all();
        for (std::thread& thread : threads_) thread.join();
    }
    Threads(const Threads&) = delete;
    Threads& operator=(const Threads&) = delete;

    unsigned count() const { return count_; }

    /// work(i) for every i < count(), each in a separate thread; 0 in the caller's.
    void run(const std::function<void(unsigned)>& work) {
        {
            const std::lock_guard lock(mutex_);
            work_ = &work;
            waiting_for_ = count_ - 1;
            ++round_;
        }
        begin_.notify_all();
        work(0);
        std::unique_lock lock(mutex_);
        end_.wait(lock, [this] { return waiting_for_ == 0; });
    }

private:
    void serve(unsigned index) {
        std::uint64_t done = 0;
        while (true) {
            std::unique_lock lock(mutex_);
            begin_.wait(lock, [&] { return ends_ || round_ != done; });
            if (ends_) return;
            done = round_;
            const std::function<void(unsigned)>& work = *work_;
            lock.unlock();
            work(index);
            lock.lock();
            if (--waiting_for_ == 0) end_.notify_one();
        }
    }

    unsigned count_, waiting_for_ = 0;
    std::uint64_t round_ = 0;
    bool ends_ = false;
    const std::function<void(unsigned)>* work_ = nullptr;
    std::mutex mutex_;
    std::condition_variable begin_, end_;
    std::vector<std::thread> threads_;
};

/// First and one past the last of `count` things that part `index` of `parts` has.
inline std::size_t partBegin(std::size_t count, unsigned index, unsigned parts) {
    return count / parts * index + std::min<std::size_t>(count % parts, index);
}

// ---------------------------------------------------------------------------------------------- numbers

/// 32 bits that look random (the finaliser of MurmurHash3, Appleby).
PAPER_ANYWHERE inline std::uint32_t hashOf(std::uint32_t x) {
    x ^= x >> 16;
    x *= 0x85ebca6bu;
    x ^= x >> 13;
    x *= 0xc2b2ae35u;
    return x ^ (x >> 16);
}

/// In [0, 1), a multiple of 2^-24: of fewer than 2^29 of them the sum in double is exact.
PAPER_ANYWHERE inline float numberAt(std::uint32_t index) {
    return static_cast<float>(hashOf(index) >> 8) * 0x1p-24f;
}

inline std::vector<float> numbers(std::size_t count, Threads& threads, std::uint32_t first = 0) {
    std::vector<float> values(count);
    threads.run([&](unsigned part) {
        const std::size_t end = partBegin(count, part + 1, threads.count());
        for (std::size_t i = partBegin(count, part, threads.count()); i < end; ++i)
            values[i] = numberAt(first + static_cast<std::uint32_t>(i));
    });
    return values;
}

inline double exactSum(const float* values, std::size_t count) {
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += values[i];
    return sum;
}

/// Error bound of a float sum of numbers >= 0 whose exact sum is `exact`, if no number goes through more
/// than `additions` roundings (Higham 2002, 4.2).
inline double sumBound(double exact, double additions) {
    const double u = 0x1p-24;
    return exact * additions * u / (1 - additions * u);
}

// 16 sums side by side, which compilers put into vectors, for 4096 numbers; from there on in double.
constexpr std::size_t kLanes = 16, kRun = 4096;
constexpr double kHostAdditions = static_cast<double>(kRun / kLanes) + 1 + kLanes;

inline double sumOnHost(const float* values, std::size_t count) {
    double sum = 0;
    for (std::size_t begin = 0; begin < count; begin += kRun) {
        const std::size_t end = std::min(count, begin + kRun),
                          whole = begin + (end - begin) / kLanes * kLanes;
        float lanes[kLanes] = {};
        for (std::size_t i = begin; i < whole; i += kLanes)
            for (std::size_t lane = 0; lane < kLanes; ++lane) lanes[lane] += values[i + lane];
        for (std::size_t i = whole; i < end; ++i) lanes[i - whole] += values[i];
        float of_run = 0;
        for (const float lane : lanes) of_run += lane;
        sum += of_run;
    }
    return sum;
}

inline double sumOnHost(const float* values, std::size_t count, Threads& threads) {
    std::vector<double> sums(threads.count());
    threads.run([&](unsigned part) {
        const std::size_t begin = partBegin(count, part, threads.count());
        sums[part] = sumOnHost(values + begin, partBegin(count, part + 1, threads.count()) - begin);
    });
    double sum = 0;
    for (const double of_part : sums) sum += of_part;
    return sum;
}

// ------------------------------------------------------------------------------------------------ boxes

/// low x, y, z, high x, y, z. Minima and maxima are exact, so that any order of points gives this box.
struct Box {
    float bounds[6];
};

inline Box emptyBox() {
    const float most = std::numeric_limits<float>::infinity();
    return {{most, most, most, -most, -most, -most}};
}
inline void join(Box& box, const Box& other) {
    for (int k = 0; k < 3; ++k) {
        box.bounds[k] = std::min(box.bounds[k], other.bounds[k]);
        box.bounds[k + 3] = std::max(box.bounds[k + 3], other.bounds[k + 3]);
    }
}
inline bool operator==(const Box& a, const Box& b) { return std::equal(a.bounds, a.bounds + 6, b.bounds); }

/// Of points x y z x y z …
inline Box boxOfPoints(const float* points, std::size_t count) {
    Box box = emptyBox();
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) {
            box.bounds[k] = std::min(box.bounds[k], points[3 * i + k]);
            box.bounds[k + 3] = std::max(box.bounds[k + 3], points[3 * i + k]);
        }
    return box;
}

/// Of points x x … y y … z z …
inline Box boxOfArrays(const float* points, std::size_t begin, std::size_t end, std::size_t count) {
    Box box = emptyBox();
    for (int k = 0; k < 3; ++k) {
        const float* axis = points + k * count;
        float low[kLanes], high[kLanes];
        std::fill(low, low + kLanes, box.bounds[k]);
        std::fill(high, high + kLanes, box.bounds[k + 3]);
        std::size_t i = begin;
        for (; i + kLanes <= end; i += kLanes)
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                low[lane] = std::min(low[lane], axis[i + lane]);
                high[lane] = std::max(high[lane], axis[i + lane]);
            }
        for (; i < end; ++i) {
            low[0] = std::min(low[0], axis[i]);
            high[0] = std::max(high[0], axis[i]);
        }
        box.bounds[k] = *std::min_element(low, low + kLanes);
        box.bounds[k + 3] = *std::max_element(high, high + kLanes);
    }
    return box;
}

inline Box boxOnHost(const float* points, std::size_t count, bool arrays, Threads& threads) {
    std::vector<Box> boxes(threads.count());
    threads.run([&](unsigned part) {
        const std::size_t begin = partBegin(count, part, threads.count());
        const std::size_t end = partBegin(count, part + 1, threads.count());
        boxes[part] =
            arrays ? boxOfArrays(points, begin, end, count) : boxOfPoints(points + 3 * begin, end - begin);
    });
    Box box = emptyBox();
    for (const Box& of_part : boxes) join(box, of_part);
    return box;
}

inline std::vector<float> asArrays(const std::vector<float>& points) {
    const std::size_t count = points.size() / 3;
    std::vector<float> arrays(points.size());
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) arrays[k * count + i] = points[3 * i + k];
    return arrays;
}

// --------------------------------------------------------------------------------------------- triangles

/// Corners of an OBJ file's triangles, nine numbers a triangle. Reads what crt-meshgen writes: `v` and `f`
/// of three corners with positive numbers.
inline std::vector<float> cornersOf(const std::string& path) {
    std::ifstream file(path);
    if (!file)
        throw std::runtime_error("cannot open the mesh '" + path + "'; --meshes DIR says where it is");
    std::vector<float> places, corners;
    std::string line, word;
    while (std::getline(file, line)) {
        std::istringstream words(line);
        words >> word;
        if (line.compare(0, 2, "v ") == 0) {
            float x = 0;
            for (int k = 0; k < 3; ++k) {
                words >> x;
                places.push_back(x);
            }
        } else if (line.compare(0, 2, "f ") == 0) {
            for (int k = 0; k < 3; ++k) {
                words >> word;
                const std::size_t index = std::strtoul(word.c_str(), nullptr, 10);
                if (index == 0 || 3 * index > places.size())
                    throw std::runtime_error("'" + path + "' names a corner that is not there: " + line);
                corners.insert(corners.end(), &places[3 * (index - 1)], &places[3 * (index - 1)] + 3);
            }
        }
    }
    if (corners.empty()) throw std::runtime_error("'" + path + "' has no triangles");
    return corners;
}

struct Ray {
    float from[3], to[3];  ///< `to` is a direction, of no particular length.
};

/// From outside towards the middle of a thing of height 1 that stands on y = 0.
PAPER_ANYWHERE inline Ray rayAt(std::uint32_t index) {
    const std::uint32_t first = 8 * index;
    Ray ray;
    ray.from[0] = 4 * numberAt(first) - 2;
    ray.from[1] = 2 * numberAt(first + 1);
    ray.from[2] = -2;
    ray.to[0] = (numberAt(first + 2) - 0.5f) - ray.from[0];
    ray.to[1] = numberAt(first + 3) - ray.from[1];
    ray.to[2] = (numberAt(first + 4) - 0.5f) - ray.from[2];
    return ray;
}

/// The test of Möller and Trumbore (1997): distance in units of the direction's length, or `limit` where
/// the ray misses. A triangle is a corner and the two edges from it. The same operations everywhere; both
/// compilers have options that forbid contraction, so that processor and GPU agree bit for bit.
PAPER_ANYWHERE inline float distanceTo(const Ray& ray, const float* t, float limit) {
    const float *d = ray.to, *a = t, *e = t + 3, *f = t + 6;
    const float px = d[1] * f[2] - d[2] * f[1], py = d[2] * f[0] - d[0] * f[2],
                pz = d[0] * f[1] - d[1] * f[0];
    const float determinant = e[0] * px + e[1] * py + e[2] * pz;
    const float sx = ray.from[0] - a[0], sy = ray.from[1] - a[1], sz = ray.from[2] - a[2];
    const float inverse = 1.0f / determinant;
    const float u = (sx * px + sy * py + sz * pz) * inverse;
    const float qx = sy * e[2] - sz * e[1], qy = sz * e[0] - sx * e[2], qz = sx * e[1] - sy * e[0];
    const float v = (d[0] * qx + d[1] * qy + d[2] * qz) * inverse;
    const float distance = (f[0] * qx + f[1] * qy + f[2] * qz) * inverse;
    const bool hits = u >= 0 && v >= 0 && u + v <= 1 && distance > 0 && distance < limit;
    return hits ? distance : limit;
}

/// The nearest of `count` triangles; `count` where there is none. `fetch(i, t)` writes triangle i to t.
PAPER_WHERE_ITS_ARGUMENT_IS
template <typename Fetch>
PAPER_ANYWHERE inline std::uint32_t nearestOf(const Ray& ray, std::uint32_t count, const Fetch& fetch) {
    float limit = 3.4e38f;
    std::uint32_t nearest = count;
    for (std::uint32_t i = 0; i < count; ++i) {
        float t[9];
        fetch(i, t);
        const float distance = distanceTo(ray, t, limit);
        if (distance < limit) {
            limit = distance;
            nearest = i;
        }
    }
    return nearest;
}

/// Corner and edges of the first `count` triangles, twelve numbers each (three of four; the fourth is 0),
/// so that a GPU reads a triangle in three loads.
inline std::vector<float> tableOf(const std::vector<float>& corners, std::size_t count) {
    std::vector<float> table(12 * count);
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) {
            const float* c = &corners[9 * i];
            table[12 * i + k] = c[k];
            table[12 * i + 4 + k] = c[3 + k] - c[k];
            table[12 * i + 8 + k] = c[6 + k] - c[k];
        }
    return table;
}

/// The same numbers, nine arrays of `count`.
inline std::vector<float> tableAsArrays(const std::vector<float>& table) {
    const std::size_t count = table.size() / 12;
    std::vector<float> arrays(9 * count);
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 9; ++k) arrays[k * count + i] = table[12 * i + 4 * (k / 3) + k % 3];
    return arrays;
}

struct TableFetch {
    const float* table;
    PAPER_ANYWHERE void operator()(std::uint32_t i, float* t) const {
        for (int k = 0; k < 9; ++k) t[k] = table[12 * i + 4 * (k / 3) + k % 3];
    }
};
struct ArraysFetch {
    const float* arrays;
    std::uint32_t count;
    PAPER_ANYWHERE void operator()(std::uint32_t i, float* t) const {
        for (int k = 0; k < 9; ++k) t[k] = arrays[k * count + i];
    }
};

template <typename Fetch>
void sweepOnHost(std::uint32_t rays, std::uint32_t triangles, const Fetch& fetch, std::uint32_t* nearest,
                 Threads& threads) {
    threads.run([&](unsigned part) {
        const std::size_t end = partBegin(rays, part + 1, threads.count());
        for (std::size_t i = partBegin(rays, part, threads.count()); i < end; ++i)
            nearest[i] = nearestOf(rayAt(static_cast<std::uint32_t>(i)), triangles, fetch);
    });
}

}  // namespace paper
