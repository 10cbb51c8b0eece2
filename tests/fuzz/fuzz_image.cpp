// Image files: PFM and PPM by crt, EXR (pixels and metadata) and PNG by the codec module, as `crt compare`
// and `crt info` read them.
#include "fuzz_target.h"

#include "image/image_io.h"

/// Opens the codec module before the first run, or libFuzzer would not count what it covers.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
    const crt::fuzz::Directory directory;
    const std::string path = directory.write("empty.exr", std::string_view("\x76\x2f\x31\x01", 4));
    crt::fuzz::expectRefusalOrSuccess(crt::ErrorKind::Usage, [&] { crt::readImage(path); });
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    const std::string path = directory.write("a.image", data, size);
    fuzz::expectRefusalOrSuccess(ErrorKind::Usage, [&] {
        const Image image = readImage(path);
        const std::size_t pixels = std::size_t{image.width} * image.height;
        if (image.pixels.size() != pixels * image.channels.size() ||
            image.integers.size() != pixels * image.integer_channels.size())
            fuzz::finding("image", "does not have the pixels that its size and channels say");
        (void)metadataValue(image, "crt/sceneHash");
    });
    return 0;
}
