// The view: a moved camera, a compiled scene seen with it, the names of surfaces, and access control.
#include "compiled_scenes.h"
#include "scene_texts.h"

#include "base/error.h"
#include "base/temporary_folder.h"
#include "compile/change_view.h"
#include "view/view_state.h"
#include "view/camera_moves.h"
#include "view/file_times.h"
#include "view/http_server.h"
#include "view/messages.h"
#include "view/pace.h"
#include "view/page_changes.h"
#include "view/primitive_names.h"
#include "view/scene_source.h"
#include "view/tev_sender.h"

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

using namespace compile_test;
using namespace crt::test;
using crt::CameraPose;
using crt::operator+;
using crt::operator-;
using crt::operator*;

namespace {

constexpr double kQuarter = std::numbers::pi / 2;

CameraPose somePose() { return {{3, 4, -5}, {1, 1, 1}, {0, 1, 0}, 0}; }

void requireNear(const Vec3d& a, const Vec3d& b) {
    for (std::size_t k = 0; k < 3; ++k) REQUIRE(a[k] == Approx(b[k]).margin(1e-12));
}

/// Where the image shows a point: (0, 0) is its upper left corner, (1, 1) the lower right.
std::array<double, 2> shownAt(const crt::Camera& camera, const Vec3d& point) {
    const auto unit = [](const Vec3d& v) { return v * (1 / crt::length(v)); };
    const Vec3d view = unit(camera.target - camera.position), right = unit(crt::cross(view, camera.up));
    const Vec3d up = crt::cross(right, view), to = point - camera.position;
    const double depth = crt::dot(to, view);
    return {0.5 + crt::dot(to, right) / depth / camera.tan_half_width / 2,
            0.5 - crt::dot(to, up) / depth / camera.tan_half_height / 2};
}

std::string textOf(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

template <class T>
T numberAt(const std::vector<std::uint8_t>& bytes, std::size_t at) {
    T value{};
    REQUIRE(at + sizeof value <= bytes.size());
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

}  // namespace

TEST_CASE("an orbit keeps target and distance, and goes the way it says", "[view]") {
    CameraPose pose{{0, 0, -5}, {0, 0, 0}, {0, 2, 0}, 0};
    crt::orbit(pose, kQuarter, 0);
    // It looked along +z with +x to its left, so right of the scene is −x.
    requireNear(pose.position, {-5, 0, 0});
    crt::orbit(pose, -kQuarter, 0.3);
    requireNear(pose.position, {0, 5 * std::sin(0.3), -5 * std::cos(0.3)});
    requireNear(pose.target, {0, 0, 0});

    CameraPose other = somePose();
    const double distance = crt::length(other.position - other.target);
    for (int i = 0; i < 100; ++i) {
        crt::orbit(other, 0.7, i % 2 == 0 ? 0.5 : -0.4);
        REQUIRE(crt::length(other.position - other.target) == Approx(distance));
        REQUIRE(other.target == somePose().target);
        REQUIRE(other.up == somePose().up);
    }
}

TEST_CASE("an orbit stops a degree before the poles, from where it can be turned back", "[view]") {
    for (const double upwards : {10.0, -10.0}) {
        CameraPose pose = somePose();
        crt::orbit(pose, 0, upwards);
        const Vec3d offset = pose.position - pose.target;
        const double from_axis = std::acos(std::abs(offset[1]) / crt::length(offset));
        REQUIRE(from_axis == Approx(std::numbers::pi / 180));
        REQUIRE((offset[1] > 0) == (upwards > 0));
        const double before = offset[1];
        crt::orbit(pose, 0, -upwards / 100);
        REQUIRE(std::abs(pose.position[1] - pose.target[1]) < std::abs(before));
    }
}

TEST_CASE("a pan moves what is at the target's distance with the hand", "[view]") {
    crt::Camera camera;
    camera.tan_half_width = 0.8;
    camera.tan_half_height = 0.45;
    CameraPose start = somePose();
    start.tan_half_fov = 0.45;
    camera = crt::withPose(camera, start);
    const Vec3d point = camera.target;
    CameraPose pose = crt::poseOf(camera);
    crt::pan(pose, camera, 0.25, 0.1);
    const auto shown = shownAt(crt::withPose(camera, pose), point);
    REQUIRE(shown[0] == Approx(0.75));
    REQUIRE(shown[1] == Approx(0.4));
    requireNear(pose.position - pose.target, somePose().position - somePose().target);
}

TEST_CASE("a dolly multiplies the distance to the target", "[view]") {
    CameraPose pose = somePose();
    crt::dolly(pose, 0.5);
    requireNear(pose.position, {2, 2.5, -2});
    requireNear(pose.target, somePose().target);
}

TEST_CASE("the field of view is the angle across the shorter side, and keeps the image's shape", "[view]") {
    crt::Camera camera;
    camera.tan_half_width = 1.6 * 0.45;
    camera.tan_half_height = 0.45;
    CameraPose pose = crt::poseOf(camera);
    CHECK(crt::fovOf_deg(pose) == Approx(2 * std::atan(0.45) * 180 / std::numbers::pi));
    // The scene's own angle leaves its camera as it is, to the bit.
    CHECK(crt::withPose(camera, pose).tan_half_width == camera.tan_half_width);
    crt::setFov(pose, camera, 90);
    CHECK(crt::withPose(camera, pose).tan_half_height == Approx(1));
    CHECK(crt::withPose(camera, pose).tan_half_width == Approx(1.6));
    crt::zoom(pose, camera, 2);
    CHECK(crt::withPose(camera, pose).tan_half_height == Approx(0.5));
    for (int i = 0; i < 100; ++i) crt::zoom(pose, camera, 100);
    CHECK(crt::fovOf_deg(pose) == Approx(crt::kLeastFov_deg));
    for (int i = 0; i < 100; ++i) crt::zoom(pose, camera, 0.01);
    CHECK(crt::fovOf_deg(pose) == Approx(crt::kMostFov_deg));
    // A scene may have a narrower one.
    camera.tan_half_width = camera.tan_half_height = 1e-6;
    pose = crt::poseOf(camera);
    crt::zoom(pose, camera, 2);
    CHECK(pose.tan_half_fov == 1e-6);
}

TEST_CASE("the depth of what a ray meets is measured along the axis", "[view]") {
    crt::Camera camera;
    camera.tan_half_width = 1;
    camera.tan_half_height = 0.5;
    REQUIRE(crt::depthOfRay(camera, 0.5, 0.5, 7) == Approx(7));
    REQUIRE(crt::depthOfRay(camera, 0, 0.5, 7) == Approx(7 / std::sqrt(2.0)));
    REQUIRE(crt::depthOfRay(camera, 1, 1, 3) == Approx(2));
}

TEST_CASE("a changed view is the scene compiled with that camera and film", "[view]") {
    for (const bool lens : {false, true}) {
        Scene scene = litFloor();
        scene.camera.aperture_radius = lens ? 0.1 : 0;
        scene.film.filter = crt::PixelFilter::Gaussian;
        scene.sampler.replicates = 4;
        CompiledScene moved = compiled(scene, crt::kAovDepth | crt::kAovPrimitive);
        scene.camera.position = {2, 3, -4};
        scene.camera.target = {0, 1, 0};
        scene.camera.focus_distance = 2.5;
        scene.film.width = 100;
        scene.film.height = 50;
        scene.film.crop = {10, 5, 60, 45};
        REQUIRE(crt::changeView(moved, scene, {}));
        const CompiledScene anew = compiled(scene, crt::kAovDepth | crt::kAovPrimitive);
        CHECK(sameBytes(moved, anew));
        CHECK(moved.header().width == 50);
        CHECK(moved.header().height == 40);
        CHECK(moved.hash.empty());
    }
}

TEST_CASE("a view that only the compiler can make is left to it", "[view]") {
    Scene scene = litFloor();
    CompiledScene pinhole = compiled(scene);
    const CompiledScene before = pinhole;
    scene.camera.aperture_radius = 0.1;
    CHECK_FALSE(crt::changeView(pinhole, scene, {}));
    CHECK(sameBytes(pinhole, before));
    CHECK(pinhole.hash == before.hash);

    // A backend whose own structure reaches 100 times as far as the scene.
    scene = litFloor();
    scene.integrator.accelerator = crt::Accelerator::Bvh;
    const crt::CompileOptions reaches{.accelerator_reach = 100};
    CompiledScene traced = crt::compileScene(scene, 0, reaches);
    REQUIRE(traced.without_nodes);
    scene.camera.position = {0, 1, -200};
    CHECK(crt::changeView(traced, scene, reaches));
    scene.camera.position = {0, 1, -2000};
    CHECK_FALSE(crt::changeView(traced, scene, reaches));
}

TEST_CASE("primitives have the names of their objects and materials, shared meshes too", "[view]") {
    const Scene scene = parse(R"(
camera: {position: [0, 1, -5], target: [0, 0, 0], fov: 40}
materials: {paper: {type: diffuse, reflectance: 0.5}, ink: {type: diffuse, reflectance: 0.1}}
objects:
  - {name: one, mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,2]]}, material: ink}
  - name: many
    mesh: {positions: [[0,0,1],[1,0,1],[0,1,1],[1,1,1]], faces: [[0,1,2],[1,3,2]]}
    material: paper
    share: always
    transforms: [[{translate: [0, 0, 1]}], [{translate: [0, 0, 2]}], [{translate: [0, 0, 3]}]]
  - {name: last, mesh: {positions: [[0,0,9],[1,0,9],[0,1,9]], faces: [[0,1,2]]}, material: paper}
)");
    const Quiet quiet;  // It has no light.
    const CompiledScene c = compiled(scene);
    REQUIRE(c.instances == 3);
    const crt::PrimitiveNames names(c, scene);
    const auto is = [&](std::uint32_t id, const char* object, const char* material) {
        INFO("primitive " << id);
        CHECK(names.of(id).object == object);
        CHECK(names.of(id).material == material);
    };
    is(0, "one", "ink");
    is(1, "last", "paper");
    const auto first = listOf<CrtInstance>(c, headerOf(c).instances);
    for (const CrtInstance& instance : first) {
        is(instance.first_id, "many", "paper");
        is(instance.first_id + 1, "many", "paper");
    }
    is(first.back().first_id + 2, "", "");
    is(CRT_NONE, "", "");
}

TEST_CASE("slow devices begin with small pictures, fast ones with the whole", "[view]") {
    constexpr std::uint64_t pixels = 1280 * 720;
    crt::Pace pace;
    CHECK(pixels / (pace.firstDivisor(pixels) * pace.firstDivisor(pixels)) <= 16384);
    pace.rendered(pixels / 64, 1, 0.0144);  // A million paths a second.
    REQUIRE(pace.pathsPerSecond() == Approx(1e6));
    CHECK(pace.firstDivisor(pixels) == 8);
    CHECK(pace.nextDivisor(pixels, 8) == 2);
    CHECK(pace.nextDivisor(pixels, 2) == 1);
    CHECK(pace.samplesOfChunk(pixels, false) == 1);
    pace.rendered(pixels, 10, 0.01);
    CHECK(pace.firstDivisor(pixels) == 1);
    CHECK(pace.samplesOfChunk(pixels, false) == 30);
    CHECK(pace.samplesOfChunk(pixels, true) == 400);
    // The time to show a picture is not spent on samples as well.
    pace.handedOn(0.005);
    CHECK(pace.samplesOfChunk(pixels, false) == 30);
    for (int i = 0; i < 30; ++i) pace.handedOn(0.0245);
    CHECK(pace.samplesOfChunk(pixels, false) == 20);
    CHECK(pace.samplesOfChunk(pixels, true) == 400);
    for (int i = 0; i < 30; ++i) pace.handedOn(0.2);
    CHECK(pace.samplesOfChunk(pixels, false) == 15);
    // One slow chunk, of a busy machine, is not believed at once.
    pace.rendered(pixels, 1, 10);
    CHECK(pace.pathsPerSecond() > 5e8);
}

TEST_CASE("a changed, a new and a lost file are noticed, and what changed while it was read", "[view]") {
    const crt::TemporaryFolder folder;
    const std::string a = folder.write("a", "one"), b = folder / "b";
    crt::FileTimes times({a, b});
    CHECK_FALSE(times.changed());
    folder.write("b", "there");
    CHECK(times.changed());
    times = crt::FileTimes({a, b});
    CHECK_FALSE(times.changed());
    folder.write("a", "longer");
    CHECK(crt::FileTimes({a, b}, times).changed());
    CHECK_FALSE(crt::FileTimes({a, b}).changed());
    times = crt::FileTimes({a, b});
    std::filesystem::last_write_time(a, std::filesystem::last_write_time(a) + std::chrono::seconds(2));
    CHECK(times.changed());
    times = crt::FileTimes({a, b});
    std::filesystem::remove(b);
    CHECK(times.changed());
}

TEST_CASE("a file that may have changed after it was read, before its first look, counts as changed",
          "[view]") {
    const crt::TemporaryFolder folder;
    const std::string scene = folder.write("scene", "one"), mesh = folder.write("mesh", "two");
    const auto began = crt::FileTimes::Time::clock::now();
    const crt::FileTimes before({scene});
    const auto changedAt = [&](std::chrono::milliseconds after) {
        std::filesystem::last_write_time(mesh, began + after);
        return crt::FileTimes({scene, mesh}, before, began).changed();
    };
    CHECK(changedAt(std::chrono::milliseconds{5}));
    CHECK_FALSE(changedAt(std::chrono::milliseconds{-100}));
}

TEST_CASE("the files of a message are those before its places", "[view]") {
    const std::string message =
        "room/box.yaml:3:7: error: there is no key 'x'\n  x: 1\n  ^\nC:/a:b.obj:12: error: bad\n"
        "whole.ply: error: too short\nnothing here\n";
    CHECK(crt::filesNamedIn(message) ==
          std::vector<std::string>{"room/box.yaml", "C:/a:b.obj", "whole.ply"});
}

TEST_CASE("who does not know the token, or comes from elsewhere, is refused", "[view]") {
    const std::string token = "0123456789abcdef";
    const auto refused = [&](const char* host, const char* origin, const std::string& given) {
        return !crt::refusal(8080, host, origin, token, given).empty();
    };
    CHECK_FALSE(refused("127.0.0.1:8080", "", token));
    CHECK_FALSE(refused("localhost:8080", "http://localhost:8080", token));
    CHECK(refused("127.0.0.1:8080", "", ""));
    CHECK(refused("127.0.0.1:8080", "", "0123456789abcdeF"));
    CHECK(refused("127.0.0.1:8080", "", token + "0"));
    CHECK(refused("127.0.0.1:8080", "", token.substr(1)));
    CHECK(refused("127.0.0.1:8081", "", token));
    CHECK(refused("evil.example:8080", "", token));
    CHECK(refused("", "", token));
    CHECK(refused("127.0.0.1:8080", "http://evil.example", token));
    CHECK(refused("127.0.0.1:8080", "http://127.0.0.1:9000", token));
    CHECK(refused("127.0.0.1:8080", "null", token));
    CHECK(crt::randomToken() != crt::randomToken());
    CHECK(crt::randomToken().size() == 32);
}

TEST_CASE("what pages ask for is read, or refused by name", "[view]") {
    const auto only = [](const char* text) {
        const auto changes = crt::readChanges(text);
        REQUIRE(changes.size() == 1);
        return changes[0];
    };
    const crt::ViewChange change =
        only(R"({"orbit": [0.5, -1], "dolly": 2, "samples": 16, "white": "D50", "paused": true})").change;
    CHECK((*change.orbit)[1] == -1);
    CHECK(change.dolly == 2);
    CHECK(change.samples == 16u);
    CHECK(change.white == "D50");
    CHECK(change.paused == true);
    CHECK_FALSE(change.pan);
    for (const char* text : {"", "1", "{"}) CHECK_THROWS_AS(crt::readChanges(text), crt::Error);
    for (const char* text :
         {"[[]]", "[1]", "{\"orbit\": 1}", "{\"orbit\": [1, \"x\"]}", "{\"dolly\": 0}", "{\"dolly\": 1e99}",
          "{\"samples\": 0}", "{\"paused\": 1}", "{\"exposure_ev\": null}", "{\"focus\": [2, 0]}",
          "{\"fov_deg\": 180}", "{\"zoom\": 0}", "{\"exposure_step\": 101}", "{\"toggle_paused\": 1}"})
        CHECK_FALSE(only(text).refusal.empty());
    CHECK_THAT(only("{\"orbitt\": [0, 0]}").refusal, Contains("did you mean 'orbit'?"));
}

TEST_CASE("a change that cannot be read leaves those beside it as they are", "[view]") {
    const auto changes = crt::readChanges(R"([{"dolly": 2}, {"dolly": 0}, {"pan": [0, 1]}])");
    REQUIRE(changes.size() == 3);
    CHECK(changes[0].change.dolly == 2);
    CHECK_FALSE(changes[1].refusal.empty());
    CHECK(changes[2].change.pan);
    CHECK(changes[2].refusal.empty());
    CHECK(crt::readChanges("[]").empty());
}

TEST_CASE("a page's change counts once, however often it is sent", "[view]") {
    crt::PageChanges taken;
    for (const std::uint64_t number : {1, 2, 3}) CHECK(taken.take("a", number));
    for (const std::uint64_t number : {1, 2, 3}) CHECK_FALSE(taken.take("a", number));
    CHECK(taken.take("b", 1));
    CHECK(taken.take("a", 4));
    // A page that goes on is not forgotten for many that came once.
    for (std::uint64_t i = 0; i < 1000; ++i) {
        CHECK(taken.take("once " + std::to_string(i), 1));
        CHECK(taken.take("a", 5 + i));
        CHECK_FALSE(taken.take("a", 5 + i));
    }
}

TEST_CASE("the camera's YAML is read back as that camera", "[view]") {
    CameraPose pose{{1.5, -2.25, 1e-3}, {0, 0.125, 300}, {0, 0, 1}, 12.5};
    pose.tan_half_fov = std::tan(20 * std::numbers::pi / 180);
    const std::string yaml = crt::cameraYaml(pose, true, true);
    const Scene scene = parse(yaml + "  aperture_radius: 0.1\n");
    CHECK(crt::fovOf_deg(crt::poseOf(scene.camera)) == Approx(40));
    CameraPose read = crt::poseOf(scene.camera);
    read.tan_half_fov = pose.tan_half_fov;
    CHECK(read == pose);
    for (const char* key : {"focus", "fov"})
        CHECK(crt::cameraYaml(pose, false, false).find(key) == std::string::npos);
}

TEST_CASE("packets for tev have its layout", "[view]") {
    const auto create = crt::tevCreateImage("a.yaml", 640, 360);
    CHECK(numberAt<std::uint32_t>(create, 0) == create.size());
    CHECK(textOf(create).substr(4) ==
          std::string("\x04\0a.yaml\0\x80\x02\0\0\x68\x01\0\0\x03\0\0\0R\0G\0B\0", 27));
    const std::vector<float> rgb{1, 2, 3, 4, 5, 6};
    const auto update = crt::tevUpdateImage("a", 2, 1, rgb);
    CHECK(numberAt<std::uint32_t>(update, 0) == update.size());
    CHECK(textOf(update).substr(4, 14) == std::string("\x06\0a\0\x03\0\0\0R\0G\0B\0", 14));
    std::size_t at = 18;
    for (const std::int32_t expected : {0, 0, 2, 1}) {
        CHECK(numberAt<std::int32_t>(update, at) == expected);
        at += 4;
    }
    for (const std::int64_t expected : {0, 1, 2, 3, 3, 3}) {
        CHECK(numberAt<std::int64_t>(update, at) == expected);
        at += 8;
    }
    REQUIRE(update.size() == at + rgb.size() * sizeof(float));
    CHECK(std::memcmp(update.data() + at, rgb.data(), rgb.size() * sizeof(float)) == 0);

    CHECK(crt::parseTevAddress("somewhere").port == "14158");
    CHECK(crt::parseTevAddress("there:99").host == "there");
    for (const char* text : {"", ":1", "there:", "there:0", "there:65536", "there:x"})
        CHECK_THROWS_AS(crt::parseTevAddress(text), crt::Error);
}

TEST_CASE("who waits at the state is woken by news and by its end", "[view]") {
    crt::ViewState state;
    CHECK_FALSE(state.isWatched());
    const std::uint64_t version = state.now().version;
    CHECK(state.isWatched());
    std::thread writer([&] { state.update([](crt::Status& status) { status.title = "news"; }); });
    const auto copy = state.waitBeyond(version, std::chrono::seconds(60));
    writer.join();
    CHECK(copy.status.title == "news");
    CHECK(copy.version != version);
    std::thread closer([&] { state.close(); });
    CHECK(state.waitBeyond(copy.version, std::chrono::seconds(60)).closed);
    closer.join();
}
