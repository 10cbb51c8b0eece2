// Checkpoint files → Film → checkpoint file. A random file never has the right checksum, so the first byte
// of the input chooses: 0 takes the rest as it is; 1 puts in the checksum that belongs to it; anything else
// the size of the file as well.
#include "fuzz_target.h"

#include "film/checkpoint.h"
#include "film/error_estimate.h"
#include "scene/scene.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <vector>

namespace {

constexpr std::size_t kFileBytesAt = 16, kChecksumAt = 24, kAfterChecksum = 32;  // As checkpoint.h has it.

void putChecksum(std::vector<std::uint8_t>& file, bool size_too) {
    if (file.size() < kAfterChecksum) return;
    const std::uint64_t size = file.size();
    if (size_too) std::memcpy(&file[kFileBytesAt], &size, sizeof size);
    XXH3_state_t* const state = XXH3_createState();
    XXH3_64bits_reset(state);
    XXH3_64bits_update(state, file.data(), kChecksumAt);
    XXH3_64bits_update(state, file.data() + kAfterChecksum, file.size() - kAfterChecksum);
    const std::uint64_t sum = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    std::memcpy(&file[kChecksumAt], &sum, sizeof sum);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    if (size == 0) return 0;
    std::vector<std::uint8_t> file(data + 1, data + size);
    if (data[0] != 0) putChecksum(file, data[0] != 1);
    const std::string path = directory.write("a.crtfilm", file.data(), file.size());

    fuzz::expectRefusalOrSuccess(ErrorKind::Usage, [&] {
        const auto [film, identity] = readCheckpoint(path);
        requireSameScene(path, identity, {identity.scene_hash, "another version"});
        // What follows a resume: adding to an empty film, errors and an image.
        Film resumed(film.shape());
        resumed.add(film);
        if (resumed.samples.ranges() != film.samples.ranges())
            fuzz::finding("film", "samples got lost while adding");
        (void)crt::estimateError(resumed);
        (void)resumed.invalidSamples();
        const Image image = resolveImage(resumed, Development{}, film.shape().aovs);
        if (image.width != film.shape().width || image.height != film.shape().height)
            fuzz::finding("film", "resolves to another size");
        if (mergeCheckpoints({path}).first.samples.ranges() != film.samples.ranges())
            fuzz::finding("film", "a merge of one is not that one");
    });
    return 0;
}
