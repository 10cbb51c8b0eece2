// Sequences: values that follow the frame, names of files, and what is kept from frame to frame.
#include "base/error.h"
#include "base/frame_cache.h"
#include "base/temporary_folder.h"
#include "cli/frames.h"
#include "compiled_scenes.h"
#include "scene/textures/texture_files.h"

#include <string>

using crt::changeOfFrame;
using crt::fileOfFrame;
using crt::KeptFrames;
using crt::parseFrames;

namespace {

std::string valueIn(const std::string& value, std::int64_t frame) {
    return changeOfFrame({"key", value}, frame).value;
}

template <class Call>
std::string refusalOf(const Call& call) {
    try {
        call();
    } catch (const crt::Error& error) {
        CHECK(error.kind() == crt::ErrorKind::Usage);
        return error.what();
    }
    return "accepted";
}

}  // namespace

// Fails when an expression is cut in the wrong place, or a text that only looks like one is computed.
TEST_CASE("values of a sequence follow the frame", "[sequence]") {
    CHECK(valueIn("15*frame", 3) == "45");
    CHECK(valueIn("frame/4", 3) == "0.75");
    CHECK(valueIn("[cos(frame*pi), min(frame, 2), 3]", 4) == "[1, 2, 3]");
    CHECK(valueIn("{rotate: {axis: [0, 1, 0], angle_deg: 15 * frame}}", 2) ==
          "{rotate: {axis: [0, 1, 0], angle_deg: 30}}");
    CHECK(valueIn("frame < 5 ? 1 : 0", 4) == "1");
    CHECK(valueIn("2^frame", 10) == "1024");
    CHECK(valueIn("frame*0.1", 3) == "0.30000000000000004");
    // None of these is an expression.
    for (const char* text :
         {"'frame'", "\"a frame\"", "keyframes", "frame_of_wood.png", "12:30", "[1, 2]", ""})
        CHECK(valueIn(text, 7) == text);
    CHECK_THAT(refusalOf([] { valueIn("picture-frame.png", 1); }), Contains("stands in quotes"));
    CHECK_THAT(refusalOf([] { valueIn("frame +", 1); }), Contains("--set key") && Contains("frame +"));
    CHECK_THAT(refusalOf([] { valueIn("1/frame", 0); }), Contains("not a number in frame 0"));
}

TEST_CASE("frames are counted, and their files are named", "[sequence]") {
    CHECK(parseFrames("0:24", "--frames").count() == 24);
    const crt::FrameRange tens = parseFrames("5:36:10", "--frames");
    CHECK((tens.first == 5 && tens.end == 36 && tens.step == 10 && tens.count() == 4));
    for (const char* text :
         {"24", "5:5", "6:5", "-1:5", "0:10:0", "0:10:-1", "a:b", "0:1:2:3", "0:", "", "0:99999999999"})
        CHECK_THAT(refusalOf([&] { parseFrames(text, "--frames"); }), Contains("--frames needs"));
    CHECK(fileOfFrame("out/turn.png", 7) == "out/turn.0007.png");
    CHECK(fileOfFrame("out/turn.0.exr", 12345) == "out/turn.0.12345.exr");
    CHECK(fileOfFrame("out/##.png", 7) == "out/07.png");
    CHECK(fileOfFrame("a#b/f-###.exr", 1234) == "a#b/f-1234.exr");
    CHECK(fileOfFrame("-", 7) == "-");
    CHECK(fileOfFrame("-.png", 7) == "-.png");
}

// Fails when what is kept is found for something else, or is not dropped.
TEST_CASE("frames with kept trees and images are those without", "[sequence]") {
    using namespace compile_test;
    const crt::TemporaryFolder folder;
    const auto image = [&](char red) {
        // A PFM of one pixel; the last byte of a float is its exponent.
        return folder.write("a.pfm", std::string("PF\n1 1\n-1.0\n") + std::string(3, red) + "\x3e" +
                                         std::string(7, '\0') + "\x3e");
    };
    const auto scene = [&](double height, const std::string& file) {
        Scene made = litFloor();
        made.integrator.accelerator = crt::Accelerator::Bvh;
        made.meshes[1].positions[0][1] = height;
        made.textures.resize(1);
        made.textures[0].image = crt::TextureFiles().open(file, {});
        made.materials[0].reflectance_texture = 0;
        made.meshes[0].uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
        made.meshes[0].uv_index = made.meshes[0].triangles;
        return made;
    };
    const CompiledScene low = compiled(scene(2, image('a'))), high = compiled(scene(3, image('z')));
    REQUIRE_FALSE(sameBytes(low, high));
    {
        const KeptFrames keeping;
        for (int round = 0; round < 3; ++round) {
            KeptFrames::nextFrame();
            CHECK(sameBytes(compiled(scene(2, image('a'))), low));
            CHECK(sameBytes(compiled(scene(3, image('z'))), high));
        }
    }
    CHECK_FALSE(KeptFrames::wanted());

    // Results that a frame does not use are dropped.
    static crt::FrameCache<int, int> cache;
    const KeptFrames keeping;
    int made = 0;
    const auto ask = [&] { return *cache.of([] { return 1; }, [&] { return ++made; }); };
    CHECK((ask() == 1 && ask() == 1));
    KeptFrames::nextFrame();
    CHECK(ask() == 1);
    KeptFrames::nextFrame();
    KeptFrames::nextFrame();
    CHECK(ask() == 2);
}
