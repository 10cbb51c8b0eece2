/// The CUDA integrator: uploads a scene, launches the kernel over a range of samples, reads the film back.
#pragma once

#include "cuda_device.h"
#include "cuda_program.h"
#include "cuda_wavefront.h"

#include "common/film_slices.h"
#include "common/launch_loop.h"

#include "backend/crt_backend.h"
#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"
#include "kernel/dialect/layout.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

namespace crt::cuda {

/// One GPU with one scene. Film and scene live on the device between calls. Failures are thrown as
/// PluginError.
class CudaIntegrator {
public:
    CudaIntegrator(const plugin::Host& host, const CrtCreateInfo& info);
    ~CudaIntegrator();
    CudaIntegrator(const CudaIntegrator&) = delete;
    CudaIntegrator& operator=(const CudaIntegrator&) = delete;

    void setScene(const CrtSceneBlob& scene);
    bool render(const CrtRenderRange& range);
    void readFilm(const CrtFilmView& film);
    void report(CrtBackendReport& report);

private:
    /// The target of kernels: the film, or a row of films of the same shape, one per slice.
    struct DeviceFilm {
        Memory sums, counts, primitives;
        std::uint64_t bytes() const { return sums.bytes() + counts.bytes() + primitives.bytes(); }
    };
    DeviceFilm allocateFilm(std::uint64_t copies, const char* what);
    /// Makes room for this number of slices, or for as many as free memory allows; returns the number.
    std::uint32_t ensureSlices(std::uint32_t slices);
    void noteMemory();
    double launch(const Launch& launch);
    /// The samples of a launch, in slices or not, by waves or by crt_render.
    void launchKernels(const std::vector<Module>& kernels, const Launch& launch);
    void launchRender(const Module& module, const Launch& launch, std::uint32_t slices,
                      const WaveTarget& target);
    void addSlices(const Module& module, const Launch& launch, std::uint32_t slices);

    plugin::Host host_;
    std::jthread opening_compiler_;  ///< While the device is opened.
    Device device_;
    Context context_;
    CUevent start_ = nullptr, end_ = nullptr;
    CrtKernelChoice kernel_choice_;
    std::uint32_t tile_size_;
    LaunchPacer pacer_;
    bool paced_for_waves_ = false;

    std::unique_ptr<CudaProgram> program_;
    std::optional<Wavefront> wavefront_;  ///< Allocated if the scene requests it.
    kernel::CrtScene scene_{};  ///< The blob's header.
    Memory blob_, rays_;
    DeviceFilm film_, slices_;
    std::uint32_t slice_count_ = 0;  ///< Films in slices_.

    double compile_seconds_ = 0, cache_seconds_ = 0;  ///< Of programs that are no longer in use.
    double upload_seconds_ = 0;
    plugin::LaunchTotals launched_;
    std::uint64_t peak_bytes_ = 0;
};

}  // namespace crt::cuda
