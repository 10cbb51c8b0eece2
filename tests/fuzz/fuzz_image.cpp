// Image files: PFM and PPM by crt, EXR (pixels and metadata) and PNG by the codec module, as `crt compare`
// and `crt info` read them.
#include "fuzz_target.h"

#include "image/image_io.h"
#include "image/open_module.h"

/// Opens the codec module before the first run: libFuzzer counts what a module covers that is there then.
/// Without it every input would be refused unread.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
    try {
        crt::imageModule(crt::ModuleFormat::Exr, "seed.exr", crt::ErrorKind::Usage);
        crt::imageModule(crt::ModuleFormat::Plain, "seed.png", crt::ErrorKind::Usage);
    } catch (const crt::Error& error) {
        crt::fuzz::finding("there are no codecs", error.what());
    }
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
            fuzz::finding("image", "has a number of values that contradicts its size and channels");
        (void)metadataValue(image, "crt/sceneHash");
    });
    return 0;
}
