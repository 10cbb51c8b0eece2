// Checkpoint files → Film → checkpoint file and images. A random file never has the right checksum, so
// the first byte of the input chooses: 0 takes the rest as it is; 1 puts in the checksum that belongs to it;
// anything else the size of the file as well.
#include "fuzz_target.h"

#include "film/checkpoint.h"
#include "film/resolve.h"
#include "film/error_estimate.h"
#include "image/image_io.h"
#include "render/outputs.h"
#include "scene/scene.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstring>
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

/// A NaN is like itself.
bool sameBits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0;
}

/// The steps of `crt develop` for a film that has a record.
void develop(const crt::Film& film, crt::FilmIdentity identity, const crt::fuzz::Directory& directory) {
    using namespace crt;
    FilmRecord& record = *identity.record;
    const std::string text = recordText(record);
    if (recordText(readRecord(text)) != text)
        fuzz::finding("film", "a record changes on its way through JSON");
    for (const OutputFormat format : {OutputFormat::Ppm, OutputFormat::Pfm})
        writeOutput({.file = directory.file("a"), .format = format, .aovs = 0, .place = {}}, film, identity);
    // The lower right pixel.
    const auto right = static_cast<int>(film.shape().width), bottom = static_cast<int>(film.shape().height);
    const Film part = cropped(film, {right - 1, bottom - 1, right, bottom});
    record.window = {record.window[2] - 1, record.window[3] - 1, record.window[2], record.window[3]};
    (void)developedImage({.file = "a", .format = OutputFormat::Exr, .aovs = record.aovs, .place = {}}, part,
                         identity);
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
        // Of any version of the bits, or a change of bits would make every seed worthless.
        requireSameScene(path, identity, {identity.scene_hash, "another version", identity.bits_version});
        // The steps after a resume: adding to an empty film, errors and an image.
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
        writeCheckpoint(directory.file("b.crtfilm"), film, identity);
        const auto [again, same] = readCheckpoint(directory.file("b.crtfilm"));
        if (!sameBits(again.sums, film.sums) || again.counts != film.counts ||
            again.primitives != film.primitives)
            fuzz::finding("film", "is another one after it was written and read");
        if (identity.record) develop(film, identity, directory);
    });
    return 0;
}
