// Image files as values of a scene: PNG, JPEG, TGA, EXR, HDR and PFM, header and pixels, as textures
// read them.
#include "fuzz_target.h"

#include "image/open_module.h"
#include "image/texels.h"

/// Opens the codec module before the first run: libFuzzer counts what a module covers that is there then.
/// Without it every input would be refused unread.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
    try {
        crt::imageModule(crt::ModuleFormat::Exr, "seed.exr", crt::ErrorKind::Scene);
        crt::imageModule(crt::ModuleFormat::Plain, "seed.png", crt::ErrorKind::Scene);
    } catch (const crt::Error& error) {
        crt::fuzz::finding("there are no codecs", error.what());
    }
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    const std::string path = directory.write("a.image", data, size);
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
        const Texels texels = readTexels(path);
        if (texels.bytes.size() != texels.info.bytes() || texels.info.count() > kMostTexels ||
            (texels.info.channels != 1 && texels.info.channels != 3))
            fuzz::finding("texels", "are not what their size and channels say");
        if (linearRgb(texels, TexelColor::Auto, path).size() != 3 * texels.info.count())
            fuzz::finding("texels", "are not as many as the pixels");
    });
    return 0;
}
