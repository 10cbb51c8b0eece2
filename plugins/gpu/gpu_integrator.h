/// The integrator of backends that work in launches: uploads a scene, launches its kernels over ranges of
/// samples, reads the film back.
#pragma once

#include "gpu_device.h"
#include "gpu_program.h"
#include "gpu_wavefront.h"

#include "backend/crt_backend.h"
#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"
#include "kernel/dialect/layout.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crt::gpu {

/// One device with one scene. Film and scene live on the device between calls. Failures are thrown as
/// PluginError.
class GpuIntegrator {
public:
    GpuIntegrator(const plugin::Host& host, const CrtCreateInfo& info, std::unique_ptr<GpuDevice> device);
    ~GpuIntegrator();
    GpuIntegrator(const GpuIntegrator&) = delete;
    GpuIntegrator& operator=(const GpuIntegrator&) = delete;

    void setScene(const CrtSceneBlob& scene);
    bool render(const CrtRenderRange& range);
    void readFilm(const CrtFilmView& film);
    void report(CrtBackendReport& report);

private:
    GpuFilm allocateFilm(std::uint64_t copies, const char* what);
    GpuBuffer allocateFilled(std::uint64_t bytes, unsigned char value, const char* what);
    /// The kernels that the scene is rendered with from now on.
    void useKernels(const Specs& wanted, bool waits_for_them);
    /// Makes room for this number of slices, or for as many as free memory allows; returns the number.
    std::uint32_t ensureSlices(std::uint32_t slices);
    void noteMemory();
    /// Renders what a launch asks for. Returns seconds.
    double launch(const Launch& launch);
    /// The samples of a launch, in slices or not, by waves or by crt_render.
    void launchKernels(const std::vector<GpuKernel>& kernels, const Launch& launch);
    void launchRender(const GpuKernel& kernel, const Launch& launch, std::uint32_t slices,
                      const LaunchTarget& target);
    void addSlices(const GpuKernel& kernel, const Launch& launch, std::uint32_t slices);
    void log(CrtLogLevel level, const std::string& line) const;

    plugin::Host host_;
    std::unique_ptr<GpuDevice> device_;
    CrtKernelChoice kernel_choice_;
    std::uint32_t tile_size_;
    LaunchPacer pacer_;
    bool paced_for_waves_ = false;

    std::unique_ptr<GpuProgram> program_;
    std::optional<Wavefront> wavefront_;  ///< None: the scene is not rendered in waves.
    kernel::CrtScene scene_{};            ///< The blob's header.
    GpuBuffer blob_, rays_;
    GpuBuffer splats_;  ///< One plane, for the film and for all slices; no memory: the film takes none.
    GpuFilm film_, slices_;
    std::uint32_t slice_count_ = 0;  ///< Films in slices_.

    double compile_seconds_ = 0, cache_seconds_ = 0;  ///< Of programs that are no longer in use.
    double upload_seconds_ = 0, render_seconds_ = 0;
    std::uint64_t paths_ = 0;  ///< Of this scene, as render_seconds_.
    std::uint64_t peak_bytes_ = 0;
};

/// The integrator of a plugin whose devices are opened as `Device`.
template <class Device>
struct GpuPlugin : GpuIntegrator {
    GpuPlugin(const plugin::Host& host, const CrtCreateInfo& info)
        : GpuIntegrator(host, info, std::make_unique<Device>(host, info)) {}
};

}  // namespace crt::gpu
