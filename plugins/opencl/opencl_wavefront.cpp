#include "opencl_wavefront.h"

#include "backend/sdk/gpu_schedule.h"
#include "common/film_slices.h"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace crt::opencl {

using plugin::divideUp;

namespace {

/// Slots of a wave: enough to fill any GPU many times over.
constexpr std::uint64_t kMostSlots = std::uint64_t{1} << 21;
/// Groups that shade a queue, a compute unit; they take turns where it is longer.
constexpr std::uint64_t kGroupsPerUnit = 16;

/// Slots of a row of blocks that covers this number of pixels.
std::uint64_t slotsAcross(std::uint32_t width) {
    return divideUp(width, CRT_WAVE_BLOCK_WIDTH) * CRT_WAVE_BLOCK;
}

template <class T>
void setArgument(const Program& program, cl_uint index, const T& value) {
    check(clSetKernelArg(program.kernel.get(), index, sizeof value, &value),
          "setting kernel argument " + std::to_string(index));
}

}  // namespace

bool takesWaves(const Device& device, std::uint32_t max_depth) {
    // Pointers of 8 bytes, as the host's CrtWave has them.
    if (device.address_bits != 64) return false;
    const char* asked = std::getenv("CRT_OPENCL_WAVES");
    return !device.is_cpu || mayOutlastLaunch(max_depth) || (asked != nullptr && std::string(asked) == "1");
}

Wavefront::Wavefront(const Device& device, const Session& session, const void* blob,
                     const Allocate& allocate)
    : device_(device), session_(session), plan_(plugin::planWave(blob)) {
    const auto& scene = *static_cast<const kernel::CrtScene*>(blob);
    const std::uint32_t rows = kernel::crt_wave_rows(scene.features);
    const std::uint64_t across = slotsAcross(scene.width);
    const std::uint64_t all = across * divideUp(scene.height, CRT_WAVE_BLOCK_HEIGHT);
    const std::uint64_t affordable = std::min(device.memory_bytes / 16 / plan_.bytesPerSlot(rows),
                                              device.largest_buffer_bytes / (rows * sizeof(kernel::vec4)));
    const std::uint64_t most = std::min(kMostSlots, affordable);
    slots_ = std::max(std::min(all, most), across) / CRT_WAVE_BLOCK * CRT_WAVE_BLOCK;
    header_ = allocate(sizeof(kernel::CrtWave), "the header of a wave");
    rows_ = allocate(slots_ * rows * sizeof(kernel::vec4), "the paths of a wave");
    words_ = allocate(CRT_WAVE_WORDS(slots_, plan_.queues()) * sizeof(cl_uint), "the queues of a wave");
}

void Wavefront::run(const Program& program, std::uint64_t groups) const {
    const std::size_t local = CRT_WAVE_BLOCK, global = groups * local;
    check(clEnqueueNDRangeKernel(session_.queue.get(), program.kernel.get(), 1, nullptr, &global, &local, 0,
                                 nullptr, nullptr),
          std::string("launching ") + plugin::entryName(program.spec.entry));
}

void Wavefront::runWave(const std::vector<Program>& kernels, const kernel::CrtWave& wave,
                        const std::function<void()>& meanwhile) const {
    const cl_command_queue queue = session_.queue.get();
    const std::uint64_t words = CRT_WAVE_WORDS(std::uint64_t{wave.slots}, plan_.queues());
    const std::uint64_t lengths = CRT_WAVE_WORDS(0, plan_.queues());  // and the number of those done, last
    const cl_uint zero = 0;
    check(clEnqueueFillBuffer(queue, words_.get(), &zero, sizeof zero, (words - lengths) * sizeof zero,
                              lengths * sizeof zero, 0, nullptr, nullptr),
          "clearing the queues");
    check(clEnqueueWriteBuffer(queue, header_.get(), CL_TRUE, 0, sizeof wave, &wave, 0, nullptr, nullptr),
          "writing the header of a wave");
    const std::uint64_t blocks = wave.slots / CRT_WAVE_BLOCK;
    // Only the device has the length of a queue.
    const std::uint64_t shading = std::min(blocks, kGroupsPerUnit * session_.compute_units);
    plugin::runPasses(
        wave,
        [&](cl_uint pass) {
            setArgument(kernels.front(), 9, pass);
            run(kernels.front(), blocks);
            if (plan_.queue_of_choice != CRT_NONE) {
                setArgument(kernels.back(), 5, pass);
                run(kernels.back(), shading);
            }
            for (cl_uint shader = 0; shader < plan_.shaders(); ++shader) {
                setArgument(kernels[shader + 1], 5, pass);
                setArgument(kernels[shader + 1], 6, shader);
                run(kernels[shader + 1], shading);
            }
        },
        [&] {
            cl_uint done = 0;
            check(clEnqueueReadBuffer(queue, words_.get(), CL_TRUE, (words - 1) * sizeof done, sizeof done,
                                      &done, 0, nullptr, nullptr),
                  "rendering on '" + device_.name + "'");
            if (done < wave.slots) meanwhile();
            return done;
        });
}

void Wavefront::launch(const std::vector<Program>& kernels, const Launch& launch,
                       const WaveTarget& target, const std::function<void()>& meanwhile) const {
    for (const Program& program : kernels) {
        setArgument(program, 0, target.scene);
        setArgument(program, 1, header_.get());
        setArgument(program, 2, static_cast<cl_uint>(plan_.queues()));
        setArgument(program, 3, rows_.get());
        setArgument(program, 4, words_.get());
    }
    setArgument(kernels.front(), 5, target.sums);
    setArgument(kernels.front(), 6, target.counts);
    setArgument(kernels.front(), 7, target.primitives);
    setArgument(kernels.front(), 8, target.rays);
    plugin::inBands(launch, slots_, slotsAcross(launch.x1 - launch.x0), [&](const Launch& part) {
        kernel::CrtWave wave = plugin::waveOf(plan_, part, 1);
        kernel::crt_wave_lay_out(&wave, plan_.queues(), nullptr, nullptr);
        runWave(kernels, wave, meanwhile);
    });
}

}  // namespace crt::opencl
