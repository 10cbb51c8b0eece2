/// The CUDA integrator: uploads a scene, launches the kernel over a range of samples, reads the film back.
#pragma once

#include "cuda_device.h"
#include "cuda_program.h"

#include "backend/crt_backend.h"
#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"
#include "kernel/layout.h"

#include <cstdint>
#include <memory>

namespace crt::cuda {

/// In how many parts, each with a film of its own, a launch of `blocks` blocks should divide its samples so
/// that a device that holds `resident_blocks` at once is full, and does not end on a few last blocks. At
/// most `most`.
std::uint32_t chooseSlices(std::uint64_t blocks, std::uint64_t resident_blocks, std::uint32_t samples,
                           std::uint64_t most);

/// Bytes that films of slices may take on a device of so many bytes, so many of them free.
std::uint64_t sliceBudget(std::uint64_t device_bytes, std::uint64_t free_bytes);

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
    /// What kernels add to: the film, or a row of films of the same shape, one a slice.
    struct DeviceFilm {
        Memory sums, counts, primitives;
        std::uint64_t bytes() const { return sums.bytes() + counts.bytes() + primitives.bytes(); }
    };
    DeviceFilm allocateFilm(std::uint64_t copies, const char* what);
    /// Makes room for so many slices, or for as many as free memory allows; how many there may be.
    std::uint32_t ensureSlices(std::uint32_t slices);
    void noteMemory();
    double launch(const Launch& launch);

    plugin::Host host_;
    Device device_;
    Context context_;
    CUevent start_ = nullptr, end_ = nullptr;
    CrtKernelChoice kernel_choice_;
    std::uint32_t tile_size_;
    LaunchPacer pacer_;

    std::unique_ptr<CudaProgram> program_;
    kernel::CrtScene scene_{};  ///< The blob's header.
    Memory blob_, rays_;
    DeviceFilm film_, slices_;
    std::uint32_t slice_count_ = 0;  ///< Films in slices_.

    double compile_seconds_ = 0, cache_seconds_ = 0;  ///< Of programs that are no longer in use.
    double upload_seconds_ = 0, render_seconds_ = 0;
    std::uint64_t paths_ = 0, peak_bytes_ = 0;
};

}  // namespace crt::cuda
