/// Renders on the CPU: TBB over tiles, a tree that Embree builds or the kernel's own loop for rays.
#pragma once

#include "embree_program.h"
#include "embree_tree.h"

#include "backend/crt_backend.h"
#include "backend/sdk/plugin_guard.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

namespace crt::embree {

std::vector<CrtDevice> probeDevices(const plugin::Host& host);

class EmbreeIntegrator {
public:
    static constexpr double kAcceleratorReach = std::numeric_limits<double>::infinity();

    EmbreeIntegrator(const plugin::Host& host, const CrtCreateInfo& info);

    void setScene(const CrtSceneBlob& scene);
    bool render(const CrtRenderRange& range);
    void readFilm(const CrtFilmView& film);
    void report(CrtBackendReport& report);

private:
    struct alignas(64) Line {
        unsigned char bytes[64];
    };
    void copyBlob(const unsigned char* bytes, std::size_t size);
    bool differsInViewAlone(const CrtSceneBlob& given) const;
    const kernel::CrtScene& scene() const { return *reinterpret_cast<const kernel::CrtScene*>(blob_.get()); }
    const unsigned char* blob() const { return reinterpret_cast<const unsigned char*>(blob_.get()); }
    std::uint32_t tileSize(const CrtRenderRange& range) const;

    plugin::Host host_;
    CrtCreateInfo info_;
    unsigned threads_;
    tbb::global_control parallelism_;  ///< Lets --threads exceed the number of processors.
    tbb::task_arena arena_;
    std::unique_ptr<Device> device_;  ///< Opened when a scene needs it.
    std::unique_ptr<Tree> tree_;
    std::unique_ptr<EmbreeProgram> program_;
    std::unique_ptr<Line[]> blob_;
    std::size_t blob_bytes_ = 0;
    std::vector<double> sums_;
    std::vector<kernel::u64> counts_;
    std::vector<std::uint32_t> primitives_;
    std::vector<kernel::u64> splats_;
    double build_seconds_ = 0, render_seconds_ = 0;
    std::uint64_t paths_ = 0;
    RayTotals rays_;
};

}  // namespace crt::embree
