/// The OpenCL integrator: uploads a scene, launches the kernel over a range of samples, reads the film back.
#pragma once

#include "opencl_device.h"
#include "opencl_program.h"
#include "opencl_wavefront.h"

#include "backend/crt_backend.h"
#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"
#include "common/launch_loop.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace crt::opencl {

/// One device with one scene. Film and scene live on the device between calls. Failures are thrown as
/// PluginError.
class OpenClIntegrator {
public:
    OpenClIntegrator(const plugin::Host& host, const CrtCreateInfo& info);

    void setScene(const CrtSceneBlob& scene);
    bool render(const CrtRenderRange& range);
    void readFilm(const CrtFilmView& film);
    void report(CrtBackendReport& report);

private:
    /// A buffer of `bytes`, refused with a sentence about `what` when the device cannot hold it.
    Buffer allocate(cl_mem_flags flags, std::uint64_t bytes, const void* content, const char* what);
    void fill(const Buffer& buffer, std::uint64_t bytes, cl_uint pattern);
    /// The kernels that the scene is rendered with from now on.
    void useKernels(const std::vector<plugin::KernelSpec>& wanted);
    double launch(const Launch& launch);
    double launchRender(const Launch& launch);
    double launchWave(const Launch& launch);

    plugin::Host host_;
    Device device_;
    const Session& session_;
    CrtKernelChoice kernel_choice_;
    std::uint32_t tile_size_;
    LaunchPacer pacer_;
    bool paced_for_waves_ = false;

    std::vector<Program> programs_;  ///< Of one kernel, or of the waves' plan.
    std::optional<Wavefront> wavefront_;
    double compile_seconds_ = 0, cache_seconds_ = 0;
    Buffer scene_, sums_, counts_, primitives_, rays_;
    std::uint64_t allocated_bytes_ = 0, peak_bytes_ = 0;
    double upload_seconds_ = 0;
    plugin::LaunchTotals launched_;
};

}  // namespace crt::opencl
