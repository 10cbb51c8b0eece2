#include "gpu_wavefront.h"

#include "film_slices.h"

#include "kernel/schedule/wavefront.h"

#include <algorithm>
#include <iterator>

namespace crt::gpu {

namespace {

/// Slots of a wave: enough to fill any GPU many times over.
constexpr std::uint64_t kMostSlots = std::uint64_t{1} << 22;
/// Between two looks at how many slots are done: some tens of milliseconds, so that the host may stop the
/// wave. A pass without any slot costs a few microseconds.
constexpr std::uint64_t kPassesAtOnce = 16;

/// As kernels see it; the host cannot read there, and a kernel of OpenCL lays out the wave again.
template <class T>
T* onDevice(const GpuBuffer& buffer) {
    return static_cast<T*>(buffer.handle);
}

}  // namespace

Wavefront::Wavefront(GpuDevice& device, const void* blob)
    : device_(device),
      plan_(planWave(blob)),
      row_count_(kernel::crt_wave_rows(static_cast<const kernel::CrtScene*>(blob)->features)),
      queue_count_(plan_.queues()) {}

std::uint32_t Wavefront::mostSlices(std::uint64_t blocks_across) const {
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(1, kMostSlots / CRT_WAVE_BLOCK / std::max<std::uint64_t>(blocks_across, 1)));
}

std::uint64_t Wavefront::ensureSlots(std::uint64_t wanted, std::uint64_t least) {
    if (wanted <= slots_) return slots_;
    const DeviceTraits& device = device_.traits();
    const std::uint64_t row_bytes = row_count_ * sizeof(kernel::vec4);
    const std::uint64_t slot_bytes = plan_.bytesPerSlot(row_count_);
    const std::uint64_t budget = std::min(device.memory_bytes / 16, (device_.freeBytes() + bytes()) / 2);
    const std::uint64_t most =
        std::min({budget / slot_bytes, device.largest_buffer_bytes / row_bytes, kMostSlots});
    wanted = std::max(std::min(wanted, most), least) / CRT_WAVE_BLOCK * CRT_WAVE_BLOCK;
    if (wanted <= slots_) return slots_;
    // The old ones go first: two need not fit side by side.
    slots_ = 0;
    rows_ = GpuBuffer();
    words_ = GpuBuffer();
    const char* what = "the paths of a wave";
    try {
        device_.requireFree(wanted * slot_bytes, what);
        if (!device.struct_arguments) header_ = device_.allocate(sizeof(kernel::CrtWave), what);
        rows_ = device_.allocate(wanted * row_bytes, what);
        words_ = device_.allocate(CRT_WAVE_WORDS(wanted, queue_count_) * sizeof(std::uint32_t), what);
    } catch (...) {
        rows_ = GpuBuffer();
        throw;
    }
    slots_ = wanted;
    return slots_;
}

kernel::CrtWave Wavefront::waveOf(const Launch& part, std::uint32_t slices,
                                  const LaunchTarget& target) const {
    kernel::CrtWave wave{};
    wave.x0 = part.x0;
    wave.y0 = part.y0;
    wave.x1 = part.x1;
    wave.y1 = part.y1;
    wave.first_sample = part.first_sample;
    kernel::crt_wave_divide(&wave, part.sample_count, slices);
    std::copy(std::begin(plan_.queue_of_kind), std::end(plan_.queue_of_kind), wave.queue_of_kind);
    wave.queue_of_choice = plan_.queue_of_choice;
    wave.queue_of_miss = plan_.queue_of_miss;
    kernel::crt_wave_lay_out(&wave, queue_count_, onDevice<kernel::vec4>(rows_),
                             onDevice<kernel::u32>(words_));
    wave.sums = onDevice<kernel::f64>(target.film.sums);
    wave.counts = onDevice<kernel::u64>(target.film.counts);
    wave.primitives = onDevice<kernel::u32>(target.film.primitives);
    wave.rays = onDevice<kernel::u64>(target.rays);
    return wave;
}

GpuArguments Wavefront::argumentsOf(const kernel::CrtWave& wave, const LaunchTarget& target) const {
    if (device_.traits().struct_arguments) return {target.scene, wave, target.blob};
    const GpuFilm& film = target.film;
    return {target.blob, header_,     queue_count_,    rows_,      words_,
            film.sums,   film.counts, film.primitives, target.rays};
}

void Wavefront::runPass(const std::vector<GpuKernel>& kernels, const kernel::CrtWave& wave,
                        const LaunchTarget& target, std::uint32_t pass) const {
    const std::uint64_t blocks = wave.slots / CRT_WAVE_BLOCK;
    GpuArguments arguments = argumentsOf(wave, target);
    arguments.push_back(pass);
    const auto start = [&](const GpuKernel& kernel, std::uint64_t most, std::uint32_t lane) {
        device_.launch(kernel.entry, entryName(kernel.spec.entry),
                       {std::min(blocks, most), CRT_WAVE_BLOCK, 1, lane}, arguments);
    };
    start(kernels.front(), blocks, 0);
    // A slot is in one queue, so that the shaders of all queues may run at the same time. Those whose queues
    // crt_choose_queue fills run behind it: where that is one, in its lane.
    const auto laneOf = [](std::uint32_t queue) { return queue + 1; };
    // Only the device has the length of a queue: as many blocks as it holds at once take turns.
    if (plan_.queue_of_choice != CRT_NONE)
        start(kernels.back(), kernels.back().resident_blocks,
              plan_.chosen_queue != CRT_NONE ? laneOf(plan_.chosen_queue) : 0);
    std::uint32_t queue = 0;
    arguments.push_back(queue);
    for (; queue < plan_.shaders(); ++queue)
        start(kernels[queue + 1], kernels[queue + 1].resident_blocks, laneOf(queue));
}

void Wavefront::runWave(const std::vector<GpuKernel>& kernels, const kernel::CrtWave& wave,
                        const LaunchTarget& target, const std::function<void()>& meanwhile) const {
    constexpr std::uint64_t kWord = sizeof(std::uint32_t);
    const std::uint64_t words = CRT_WAVE_WORDS(std::uint64_t{wave.slots}, queue_count_);
    const std::uint64_t lengths = CRT_WAVE_WORDS(0, queue_count_);  // and the number of slots done, last
    device_.fill(words_, 0, (words - lengths) * kWord, lengths * kWord);
    if (header_.handle != nullptr) device_.write(header_, &wave);
    // No sample takes fewer passes than one, and the last is added in one more.
    const std::uint64_t least = std::uint64_t{wave.slice_samples} + (wave.longer_slices != 0 ? 1 : 0) + 1;
    for (std::uint32_t pass = 0, done = 0;;) {
        std::uint64_t more = pass < least ? std::min(least - pass, kPassesAtOnce) : kPassesAtOnce;
        for (; more != 0; --more) runPass(kernels, wave, target, pass++);
        device_.read(words_, &done, (words - 1) * kWord, kWord);
        if (done >= wave.slots) return;
        meanwhile();
    }
}

void Wavefront::launch(const std::vector<GpuKernel>& kernels, const Launch& launch, std::uint32_t slices,
                       const LaunchTarget& target, const std::function<void()>& meanwhile) {
    // Slots of one row of blocks, and rows of blocks that there is room for.
    const std::uint64_t across =
        divideUp(launch.x1 - launch.x0, CRT_WAVE_BLOCK_WIDTH) * slices * CRT_WAVE_BLOCK;
    const std::uint64_t down = divideUp(launch.y1 - launch.y0, CRT_WAVE_BLOCK_HEIGHT);
    const std::uint64_t slots = ensureSlots(std::min(across * down, std::max(kMostSlots, across)), across);
    const auto rows =
        static_cast<std::uint32_t>(std::max<std::uint64_t>(1, slots / across) * CRT_WAVE_BLOCK_HEIGHT);
    Launch part = launch;
    for (; part.y0 < launch.y1; part.y0 = part.y1) {
        part.y1 = std::min(launch.y1, part.y0 + rows);
        runWave(kernels, waveOf(part, slices, target), target, meanwhile);
    }
}

}  // namespace crt::gpu
