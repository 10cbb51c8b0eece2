// Scenes that a GPU renders in waves, and the kernels that they need.
#include "backend/sdk/gpu_schedule.h"
#include "compiled_scenes.h"
#include "gpu/gpu_wavefront.h"
#include "gpu/wave_plan.h"

#include <algorithm>
#include <cstdlib>
#include <set>

using namespace compile_test;
using crt::wantsWavefront;

TEST_CASE("waves are for several kinds of material in a tree, and for long ones", "[wavefront]") {
    constexpr std::uint64_t one = CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE;
    CHECK_FALSE(wantsWavefront(one | CRT_FEATURE_BRUTE_FORCE, 16));
    CHECK_FALSE(wantsWavefront(one | CRT_FEATURE_BVH, 16));
    CHECK_FALSE(wantsWavefront(one | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_BRUTE_FORCE, 16));
    CHECK(wantsWavefront(one | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_BVH, 16));
    for (const std::uint64_t lengthy :
         {CRT_FEATURE_ROUGH_CONDUCTOR, CRT_FEATURE_ROUGH_DIELECTRIC, CRT_FEATURE_PLASTIC,
          CRT_FEATURE_CLEARCOAT, CRT_FEATURE_FUZZ, CRT_FEATURE_ROUGH_BASE, CRT_FEATURE_THIN_FILM}) {
        CHECK(wantsWavefront(one | lengthy | CRT_FEATURE_BRUTE_FORCE, 16));
        // A view is no path.
        CHECK_FALSE(wantsWavefront(one | lengthy | CRT_FEATURE_VIEW, 16));
        CHECK_FALSE(wantsWavefront(one | lengthy | CRT_FEATURE_SPLAT, 16));
    }
    CHECK_FALSE(wantsWavefront(CRT_FEATURES_ALL, 16));
}

TEST_CASE("waves are for paths without end", "[wavefront]") {
    constexpr std::uint64_t one = CRT_FEATURE_DIFFUSE | CRT_FEATURE_BRUTE_FORCE;
    CHECK_FALSE(wantsWavefront(one, 1 << 16));
    CHECK(wantsWavefront(one, 1'000'000'000));
    CHECK_FALSE(wantsWavefront(one | CRT_FEATURE_VIEW, 1'000'000'000));
}

using crt::gpu::Entry;
using crt::gpu::KernelSpec;
using crt::gpu::planWave;
using crt::gpu::WavePlan;

namespace {

/// The floor is of material 0; the others are there, though nothing is made of them.
crt::Scene sceneOf(const std::vector<crt::MaterialType>& types) {
    crt::Scene scene = litFloor();
    scene.materials.resize(types.size(), scene.materials[0]);
    for (std::size_t i = 0; i < types.size(); ++i) scene.materials[i].type = types[i];
    crt::Mesh floor = scene.meshes[0];
    for (std::size_t i = 1; i < types.size(); ++i) {
        for (crt::Vec3d& p : floor.positions) p[1] -= 0.1;
        scene.meshes.push_back(floor);
        crt::Object object = scene.objects[0];
        object.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
        object.material = static_cast<std::uint32_t>(i);
        scene.objects.push_back(object);
    }
    return scene;
}

}  // namespace

TEST_CASE("each kind of material has a shader that holds no other kind", "[wavefront]") {
    const CompiledScene c = compiled(
        sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::Mirror, crt::MaterialType::Diffuse}));
    const WavePlan plan = planWave(c.data());
    REQUIRE(plan.kernels.size() == 3);
    CHECK(plan.kernels[0] == KernelSpec{Entry::Trace, c.header().features});
    REQUIRE(plan.queues() == 2);
    for (const std::uint32_t kind : {CRT_MATERIAL_DIFFUSE, CRT_MATERIAL_MIRROR}) {
        const std::uint64_t bit = std::uint64_t{1} << kind;
        const std::uint32_t queue = plan.queue_of_kind[kind];
        REQUIRE(queue < plan.queues());
        CHECK(plan.kernels[queue + 1] ==
              KernelSpec{Entry::Shade,
                         (c.header().features & ~std::uint64_t{CRT_FEATURES_MATERIALS}) | bit});
    }
    CHECK(plan.queue_of_kind[CRT_MATERIAL_DIFFUSE] != plan.queue_of_kind[CRT_MATERIAL_MIRROR]);
    // There is no mix, and nothing shines from outside.
    CHECK(plan.queue_of_choice == CRT_NONE);
    CHECK(plan.queue_of_miss == CRT_NONE);
}

TEST_CASE("a material that nothing is made of has no shader", "[wavefront]") {
    crt::Scene scene = sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::Mirror});
    scene.materials.push_back(scene.materials[0]);
    scene.materials.back().type = crt::MaterialType::Plastic;
    const CompiledScene c = compiled(scene);
    const WavePlan plan = planWave(c.data());
    CHECK(plan.queues() == 2);
    for (const KernelSpec& kernel : plan.kernels) CHECK((kernel.features & ~c.header().features) == 0);
}

TEST_CASE("a shader holds the film that its kind has, and not that of another", "[wavefront]") {
    crt::Scene scene =
        sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::Conductor, crt::MaterialType::Dielectric});
    scene.materials[1].eta = crt::constantSpectrum(0.2);
    scene.materials[1].k = crt::constantSpectrum(3);
    scene.materials[2].eta = crt::constantSpectrum(1.5);
    scene.materials[1].film_thickness_nm = 300;
    const CompiledScene c = compiled(scene);
    REQUIRE((c.header().features & CRT_FEATURE_THIN_FILM) != 0);
    const WavePlan plan = planWave(c.data());
    const auto featuresOf = [&](std::uint32_t kind) {
        return plan.kernels[plan.queue_of_kind[kind] + 1].features;
    };
    CHECK((featuresOf(CRT_MATERIAL_CONDUCTOR) & CRT_FEATURE_THIN_FILM) != 0);
    CHECK((featuresOf(CRT_MATERIAL_DIELECTRIC) & CRT_FEATURE_THIN_FILM) == 0);
    CHECK((featuresOf(CRT_MATERIAL_DIFFUSE) & CRT_FEATURE_THIN_FILM) == 0);
}

TEST_CASE("a mix goes to the queues of what it is made of", "[wavefront]") {
    crt::Scene scene =
        sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::Mirror, crt::MaterialType::Mix});
    scene.materials[2].parts = {0, 1};
    const CompiledScene c = compiled(scene);
    REQUIRE((c.header().features & CRT_FEATURE_MIX) != 0);
    const WavePlan plan = planWave(c.data());
    REQUIRE(plan.queues() == 3);
    CHECK(plan.queue_of_choice == 2);
    CHECK(plan.kernels.back().entry == Entry::Choose);
    for (const KernelSpec& kernel : plan.kernels)
        if (kernel.entry == Entry::Shade)
            CHECK((kernel.features & CRT_FEATURES_MATERIALS) != CRT_FEATURES_MATERIALS);
}

TEST_CASE("whether a ray passes a pane is worked out where mixes are chosen", "[wavefront]") {
    crt::Scene scene = sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::ThinDielectric});
    scene.materials[1].eta = crt::constantSpectrum(1.5);
    scene.materials[1].film_thickness_nm = 300;
    const CompiledScene c = compiled(scene);
    const WavePlan plan = planWave(c.data());
    REQUIRE(plan.queues() == 3);
    CHECK(plan.queue_of_choice == 2);
    CHECK(plan.kernels.back().entry == Entry::Choose);
    const std::uint64_t needed = CRT_FEATURE_THIN_DIELECTRIC | CRT_FEATURE_THIN_FILM;
    CHECK((plan.kernels.back().features & needed) == needed);
    CHECK((plan.kernels.back().features & CRT_FEATURE_DIFFUSE) == 0);
}

TEST_CASE("what meets nothing is shaded where something shines there, without any material", "[wavefront]") {
    crt::Scene scene = sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::Mirror});
    scene.environment.emplace();
    scene.environment->radiance = crt::constantSpectrum(1);
    const CompiledScene c = compiled(scene);
    REQUIRE((c.header().features & CRT_FEATURE_ENVIRONMENT) != 0);
    const WavePlan plan = planWave(c.data());
    REQUIRE(plan.queue_of_miss < plan.queues());
    CHECK((plan.kernels[plan.queue_of_miss + 1].features & CRT_FEATURES_MATERIALS) == 0);
    CHECK((plan.kernels[plan.queue_of_miss + 1].features & CRT_FEATURE_ENVIRONMENT) != 0);
}

TEST_CASE("no two queues are one, and there is room for all", "[wavefront]") {
    // One of each kind, a mix of two of them, and a sky to miss into.
    std::vector<crt::MaterialType> types;
    std::vector<std::uint32_t> kinds;
#define CRT_TYPE(F, bit, NAME, Name, word, scatter, text) \
    types.push_back(crt::MaterialType::Name);             \
    kinds.push_back(CRT_MATERIAL_##NAME);
    CRT_MATERIAL_LIST(CRT_TYPE, )
#undef CRT_TYPE
    types.push_back(crt::MaterialType::Mix);
    crt::Scene scene = sceneOf(types);
    for (crt::Material& material : scene.materials) {
        material.eta = crt::constantSpectrum(1.5);
        material.k = crt::constantSpectrum(3);
    }
    scene.materials.back().parts = {0, 1};
    scene.environment = crt::Environment{};
    scene.environment->radiance = crt::constantSpectrum(1);
    const CompiledScene c = compiled(scene);
    const WavePlan plan = planWave(c.data());
    std::set<std::uint32_t> queues{plan.queue_of_choice, plan.queue_of_miss};
    for (const std::uint32_t kind : kinds) queues.insert(plan.queue_of_kind[kind]);
    CHECK(queues.size() == kinds.size() + 2);
    CHECK(plan.queues() == queues.size());
    CHECK(*queues.rbegin() < plan.queues());
    CHECK(plan.queues() <= CRT_WAVE_QUEUES);
}

TEST_CASE("the slices of a wave take each sample of each pixel once", "[wavefront]") {
    for (const std::uint32_t samples : {1u, 7u, 64u, 199u})
        for (const std::uint32_t slices : {1u, 3u, 7u, 64u}) {
            if (slices > samples) continue;
            crt::kernel::CrtWave wave{};
            wave.x0 = 16, wave.y0 = 8, wave.x1 = 16 + 37, wave.y1 = 8 + 11;  // no whole number of blocks
            crt::kernel::crt_wave_divide(&wave, samples, slices);
            crt::kernel::crt_wave_lay_out(&wave, 1, nullptr, nullptr);
            std::vector<std::vector<std::uint32_t>> taken(37 * 11, std::vector<std::uint32_t>(samples));
            std::uint32_t least = samples, most = 0;
            for (std::uint32_t slot = 0; slot < wave.slots; ++slot) {
                const crt::kernel::CrtWaveShare share = crt::kernel::crt_wave_share(&wave, slot);
                if (share.count == 0) continue;  // beyond the edge
                REQUIRE(share.slice < slices);
                for (std::uint32_t i = 0; i < share.count; ++i)
                    ++taken.at((share.y - 8) * 37 + (share.x - 16)).at(share.first + i);
                least = std::min(least, share.count);
                most = std::max(most, share.count);
            }
            for (const std::vector<std::uint32_t>& pixel : taken)
                REQUIRE(std::set<std::uint32_t>(pixel.begin(), pixel.end()) == std::set<std::uint32_t>{1});
            CHECK(most - least <= 1);
        }
}

namespace {

/// A device that runs nothing: it notes what is launched, and answers that all slots are done.
class NotingDevice final : public crt::gpu::GpuDevice {
public:
    struct Noted {
        std::string name;
        std::uint32_t lane;
    };
    std::vector<Noted> launches;

    NotingDevice() {
        traits_.memory_bytes = std::uint64_t{1} << 30;
        traits_.struct_arguments = true;
    }
    std::unique_ptr<crt::gpu::GpuProgram> makeProgram(const crt::plugin::Host&, const crt::gpu::Specs&,
                                                      CrtKernelChoice) override {
        return nullptr;
    }
    std::uint64_t freeBytes() const override { return traits_.memory_bytes; }
    void fill(const crt::gpu::GpuBuffer&, unsigned char, std::uint64_t, std::uint64_t) const override {}
    void write(const crt::gpu::GpuBuffer&, const void*) const override {}
    void read(const crt::gpu::GpuBuffer&, void* to, std::uint64_t, std::uint64_t bytes) const override {
        std::fill_n(static_cast<unsigned char*>(to), bytes, static_cast<unsigned char>(0xff));
    }
    void launch(void*, const char* name, const crt::gpu::GpuGrid& grid,
                const crt::gpu::GpuArguments&) override {
        launches.push_back({name, grid.lane});
    }
    double seconds(const std::function<void()>& start) override { return start(), 1.0; }

private:
    std::shared_ptr<void> take(std::uint64_t bytes) override { return {std::malloc(bytes), std::free}; }
};

/// The launches of a wave of three samples of 16 × 16 pixels.
std::vector<NotingDevice::Noted> launchesOf(const CompiledScene& c) {
    NotingDevice device;
    crt::gpu::Wavefront wavefront(device, c.data());
    std::vector<crt::gpu::GpuKernel> kernels;
    for (const KernelSpec& spec : wavefront.plan().kernels) kernels.push_back({spec});
    crt::Launch launch;
    launch.x1 = launch.y1 = 16;
    launch.sample_count = 3;
    const crt::gpu::GpuBuffer none;
    const crt::gpu::GpuFilm film;
    wavefront.launch(kernels, launch, 1, {c.header(), none, film, none}, [] {});
    // Trace, choose, and one shader for each of two materials; one pass more than samples.
    REQUIRE(device.launches.size() == 4 * 4);
    for (std::size_t i = 0; i < device.launches.size(); i += 4) {
        const NotingDevice::Noted* pass = &device.launches[i];
        CHECK(pass[0].name == "crt_trace");
        CHECK(pass[0].lane == 0);
        CHECK(pass[1].name == "crt_choose_queue");
        CHECK(pass[2].name == "crt_shade_queue");
        CHECK(pass[3].name == "crt_shade_queue");
        CHECK(std::set<std::uint32_t>{0, pass[2].lane, pass[3].lane}.size() == 3);
    }
    return device.launches;
}

}  // namespace

TEST_CASE("in a pass, shaders run at the same time, and all else alone", "[wavefront]") {
    crt::Scene scene =
        sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::Mirror, crt::MaterialType::Mix});
    scene.materials[2].parts = {0, 1};
    const std::vector<NotingDevice::Noted> launches = launchesOf(compiled(scene));
    for (std::size_t i = 1; i < launches.size(); i += 4) CHECK(launches[i].lane == 0);
}

TEST_CASE("panes are chosen beside the shaders of other materials", "[wavefront]") {
    crt::Scene scene = sceneOf({crt::MaterialType::Diffuse, crt::MaterialType::ThinDielectric});
    scene.materials[1].eta = crt::constantSpectrum(1.5);
    const CompiledScene c = compiled(scene);
    const std::uint32_t panes = planWave(c.data()).queue_of_kind[CRT_MATERIAL_THIN_DIELECTRIC];
    std::vector<NotingDevice::Noted> launches = launchesOf(c);
    // In the lane of the panes' shader, and before it.
    for (std::size_t i = 1; i < launches.size(); i += 4)
        CHECK(launches[i].lane == launches[i + 1 + panes].lane);

    // A hole may show any material.
    scene.materials[1].opacity = 0.5;
    launches = launchesOf(compiled(scene));
    for (std::size_t i = 1; i < launches.size(); i += 4) CHECK(launches[i].lane == 0);
}
