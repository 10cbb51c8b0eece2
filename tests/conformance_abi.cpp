// The border itself: what a host may do wrong, and what it may count on. Runs on the C table, not on its C++
// face.
#include "conformance.h"
#include "render_range.h"

#include "backend/crt_layout_hash.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <vector>

using namespace conformance;

namespace {

const char* kScene =
    "crt: 1\ncamera: {position: [0, 0, -3], target: [0, 0, 0], fov: 60}\nfilm: {resolution: [16, "
    "12]}\nenvironment: {radiance: 1}\n"
    "materials: {white: {type: diffuse, reflectance: 0.5}}\n"
    "objects: [{name: t, mesh: {positions: [[-1,-1,0],[1,-1,0],[0,1,0]], "
    "faces: [[0,1,2]]}, material: white}]\n";

/// An integrator through the C table alone, with a host that counts calls and can cancel.
struct Raw {
    CrtHost host = crt::makeHost(false);
    const CrtHost inner = host;
    std::atomic<int> progress_calls{0};
    std::atomic<bool> cancel{false};
    CrtIntegrator integrator{};
    CrtStatus created = CRT_INTERNAL;
    char reason[256] = {};

    explicit Raw(const char* device = nullptr) {
        host.user = this;
        host.log = [](void*, CrtLogLevel, const char*) {};
        host.progress = [](void* user, double) -> int32_t {
            auto* self = static_cast<Raw*>(user);
            ++self->progress_calls;
            return self->cancel ? 1 : 0;
        };
        host.kernel_source = [](void* user, const char* name) {
            auto* self = static_cast<Raw*>(user);
            return self->inner.kernel_source(self->inner.user, name);
        };
        CrtCreateInfo info{};
        info.struct_size = sizeof(info);
        info.device = device;
        integrator.struct_size = sizeof(integrator);
        created = backend().table->create(&host, &info, &integrator, reason, sizeof(reason));
    }
    ~Raw() {
        if (created == CRT_OK) integrator.destroy(integrator.state);
    }
    Raw(const Raw&) = delete;
    Raw& operator=(const Raw&) = delete;

    CrtStatus setScene(const crt::CompiledScene& compiled) {
        CrtSceneBlob blob{};
        blob.struct_size = sizeof(blob);
        blob.data = compiled.data();
        blob.size_bytes = compiled.size_bytes;
        return integrator.set_scene(integrator.state, &blob);
    }
    CrtStatus render(std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1,
                     std::uint64_t first, std::uint64_t count) {
        const CrtRenderRange range = renderRange(x0, y0, x1, y1, first, count);
        return integrator.render(integrator.state, &range);
    }
};

/// Room for a film of kScene, which is 16 × 12.
struct Target {
    std::vector<double> sums;
    std::vector<std::uint64_t> counts;
    CrtFilmView view{};

    explicit Target(const crt::CompiledScene& compiled)
        : sums(16 * 12 * compiled.header().channels * 2), counts(16 * 12) {
        view.struct_size = sizeof(view);
        view.width = 16;
        view.height = 12;
        view.channels = compiled.header().channels;
        view.sums = sums.data();
        view.counts = counts.data();
    }
    Target(const Target&) = delete;
    Target& operator=(const Target&) = delete;
};

}  // namespace

TEST_CASE("the table says who it is", "[abi]") {
    const CrtBackend* table = backend().table;
    REQUIRE(table != nullptr);
    CHECK(table->struct_size >= sizeof(CrtBackend));
    CHECK(table->abi_major == CRT_ABI_MAJOR);
    CHECK(table->layout_hash == CRT_LAYOUT_HASH);
    CHECK(std::strlen(table->name) > 0);
    CHECK(std::strlen(table->version) > 0);
    CHECK(std::strlen(table->build) > 0);
    CHECK(table->features != 0);
}

TEST_CASE("probe counts without room, and fills what there is room for", "[abi]") {
    const CrtHost host = crt::makeHost(false);
    std::uint32_t count = 0;
    char reason[256] = {};
    REQUIRE(backend().table->probe(&host, nullptr, 0, &count, reason, sizeof(reason)) == CRT_OK);
    REQUIRE(count >= 1);
    CrtDevice device{};
    device.struct_size = sizeof(device);
    REQUIRE(backend().table->probe(&host, &device, 1, &count, reason, sizeof(reason)) == CRT_OK);
    CHECK(std::strlen(device.name) > 0);
    CHECK(device.score > 0);
}

TEST_CASE("a device that does not exist is refused with a sentence", "[abi]") {
    const Raw raw("no such device anywhere");
    CHECK(raw.created == CRT_NO_DEVICE);
    CHECK(std::strlen(raw.reason) > 10);
}

TEST_CASE("broken calls get a status and a sentence, never a crash", "[abi]") {
    CHECK(backend().table->create(nullptr, nullptr, nullptr, nullptr, 0) != CRT_OK);
    Raw raw;
    INFO(raw.reason);
    REQUIRE(raw.created == CRT_OK);
    const auto refused = [&](CrtStatus status) {
        CHECK(status == CRT_INVALID_ARGUMENT);
        CHECK(std::strlen(raw.integrator.last_error(raw.integrator.state)) > 5);
    };
    refused(raw.render(0, 0, 1, 1, 0, 1));  // before set_scene
    const crt::CompiledScene compiled = crt::compileScene(sceneFrom(kScene), 0);
    Target target(compiled);
    std::vector<std::uint32_t> primitives(16 * 12);
    const auto read = [&] { return raw.integrator.read_film(raw.integrator.state, &target.view); };
    refused(read());  // before set_scene, too
    refused(raw.integrator.set_scene(raw.integrator.state, nullptr));
    refused(raw.integrator.render(raw.integrator.state, nullptr));
    refused(raw.integrator.read_film(raw.integrator.state, nullptr));
    refused(raw.integrator.get_report(raw.integrator.state, nullptr));
    REQUIRE(raw.setScene(compiled) == CRT_OK);
    refused(raw.render(0, 0, 17, 12, 0, 1));
    refused(raw.render(5, 0, 4, 12, 0, 1));
    target.view.primitives = primitives.data();  // which the scene does not ask for
    refused(read());
    target.view.primitives = nullptr;
    target.view.width = 15;
    refused(read());
    target.view.width = 16;
    REQUIRE(read() == CRT_OK);
    CrtSceneBlob tiny{};
    tiny.struct_size = 4;
    refused(raw.integrator.set_scene(raw.integrator.state, &tiny));
    // And it still works.
    REQUIRE(raw.setScene(compiled) == CRT_OK);
    CHECK(raw.render(0, 0, 16, 12, 0, 1) == CRT_OK);
}

TEST_CASE("set_scene clears the film, render adds, the report counts", "[abi]") {
    Raw raw;
    REQUIRE(raw.created == CRT_OK);
    const crt::CompiledScene compiled = crt::compileScene(sceneFrom(kScene), 0);
    Target target(compiled);
    for (int round = 0; round < 2; ++round) {
        REQUIRE(raw.setScene(compiled) == CRT_OK);
        REQUIRE(raw.integrator.read_film(raw.integrator.state, &target.view) == CRT_OK);
        CHECK(
            std::all_of(target.counts.begin(), target.counts.end(), [](std::uint64_t n) { return n == 0; }));
        REQUIRE(raw.render(0, 0, 16, 12, 0, 3) == CRT_OK);
        REQUIRE(raw.render(2, 1, 16, 12, 3, 2) == CRT_OK);
        REQUIRE(raw.render(0, 0, 16, 12, 9, 0) == CRT_OK);  // nothing is a legal amount
        REQUIRE(raw.integrator.read_film(raw.integrator.state, &target.view) == CRT_OK);
        CHECK(target.counts[0] == 3);
        CHECK(target.counts[16 * 12 - 1] == 5);
        CrtBackendReport report{};
        report.struct_size = sizeof(report);
        REQUIRE(raw.integrator.get_report(raw.integrator.state, &report) == CRT_OK);
        CHECK(report.paths == 16 * 12 * 3 + 14 * 11 * 2);
        CHECK(report.closest_rays >= report.paths);
        CHECK(std::strlen(report.device) > 0);
        CHECK(std::strlen(report.kernel) > 0);
        CHECK((report.kernel_features & compiled.header().features) == compiled.header().features);
    }
    CHECK(raw.progress_calls > 0);
}

TEST_CASE("rectangles splat onto the whole film, in any order", "[abi]") {
    Raw raw;
    REQUIRE(raw.created == CRT_OK);
    crt::Scene scene = sceneFrom(kScene);
    scene.integrator.type = crt::IntegratorType::SplatTest;
    const crt::CompiledScene compiled = crt::compileScene(scene, 0);
    const std::size_t words = crt::kernel::crt_splat_words(&compiled.header());
    REQUIRE(words > 0);
    struct Rectangle {
        std::uint32_t x0, y0, x1, y1;
        std::uint64_t first, count;
    };
    const auto splatsOf = [&](const std::vector<Rectangle>& rectangles) {
        Target target(compiled);
        REQUIRE(raw.setScene(compiled) == CRT_OK);
        for (const Rectangle& r : rectangles)
            REQUIRE(raw.render(r.x0, r.y0, r.x1, r.y1, r.first, r.count) == CRT_OK);
        CHECK(raw.integrator.read_film(raw.integrator.state, &target.view) == CRT_INVALID_ARGUMENT);
        std::vector<std::uint64_t> splats(16 * 12 * words);
        target.view.splats = splats.data();
        REQUIRE(raw.integrator.read_film(raw.integrator.state, &target.view) == CRT_OK);
        return splats;
    };
    const std::vector<std::uint64_t> whole = splatsOf({{0, 0, 16, 12, 0, 8}});
    CHECK(splatsOf({{5, 3, 16, 12, 2, 6}, {0, 0, 16, 3, 0, 8}, {5, 3, 16, 12, 0, 2}, {0, 3, 5, 12, 0, 8}}) ==
          whole);
    // The samples of one row reach others.
    const std::vector<std::uint64_t> row = splatsOf({{0, 0, 16, 1, 0, 8}});
    CHECK(std::any_of(row.begin() + static_cast<std::ptrdiff_t>(16 * words), row.end(),
                      [](std::uint64_t word) { return word != 0; }));
    CHECK(row != whole);
}

TEST_CASE("a host that cancels gets CRT_CANCELLED soon", "[abi]") {
    Raw raw;
    REQUIRE(raw.created == CRT_OK);
    REQUIRE(raw.setScene(crt::compileScene(sceneFrom(kScene), 0)) == CRT_OK);
    raw.cancel = true;
    CHECK(raw.render(0, 0, 16, 12, 0, 1u << 30) == CRT_CANCELLED);  // hours of work
}

TEST_CASE("two integrators live side by side", "[abi]") {
    Raw a, b;
    REQUIRE(a.created == CRT_OK);
    REQUIRE(b.created == CRT_OK);
    const crt::CompiledScene compiled = crt::compileScene(sceneFrom(kScene), 0);
    REQUIRE(a.setScene(compiled) == CRT_OK);
    REQUIRE(b.setScene(compiled) == CRT_OK);
    CHECK(a.render(0, 0, 16, 12, 0, 1) == CRT_OK);
    CHECK(b.render(0, 0, 16, 12, 0, 1) == CRT_OK);
}
