// The example backend with a lean kernel for each scene and without a compiler: the mask of features is a
// variable here, not a constant. So tests/conformance_lean.cpp can compare kernels of hundreds of scenes.
// Other backends render fewer of them, to test what their compilers make of a constant mask.
#include <cstdint>

namespace {
/// Of the kernel that this thread runs. Fixed places: a call for each of them would take half of a render.
__attribute__((tls_model("initial-exec"))) thread_local std::uint64_t kernel_mask = ~std::uint64_t{0};
__attribute__((tls_model("initial-exec"))) thread_local int kernel_is_lean = 0;
}  // namespace

#define CRT_FEATURES kernel_mask
#define CRT_LEAN kernel_is_lean

#include "backend/sdk/plugin_guard.h"
#pragma push_macro("CRT_DEFINE_BACKEND")
#undef CRT_DEFINE_BACKEND
#define CRT_DEFINE_BACKEND(...)
#include "../../docs/example_backend/example_backend.cpp"
#pragma pop_macro("CRT_DEFINE_BACKEND")

namespace {

class MaskedIntegrator {
public:
    MaskedIntegrator(const Host& host, const CrtCreateInfo& info)
        : example_(host, info), full_(info.kernel == CRT_KERNEL_FULL) {}

    void setScene(const CrtSceneBlob& scene) {
        needed_ = reinterpret_cast<const crt::kernel::CrtScene*>(scene.data)->features;
        example_.setScene(scene);
    }

    bool render(const CrtRenderRange& range) {
        kernel_mask = mask();
        kernel_is_lean = full_ ? 0 : 1;
        return example_.render(range);
    }

    void readFilm(const CrtFilmView& film) { example_.readFilm(film); }

    void report(CrtBackendReport& report) {
        example_.report(report);
        crt::plugin::writeText(report.kernel, std::string(full_ ? "all features" : "lean, by a variable"));
        report.kernel_features = mask();
    }

private:
    std::uint64_t mask() const { return full_ ? CRT_FEATURES_ALL : needed_; }

    ExampleIntegrator example_;
    const bool full_;
    std::uint64_t needed_ = 0;
};

}  // namespace

CRT_DEFINE_BACKEND(MaskedIntegrator, listDevices, "masked", "1.0.0", CRT_FEATURES_ALL)
