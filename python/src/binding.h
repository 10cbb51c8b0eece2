/// The shared parts of the module `crt._crt`.
#pragma once

#include <crt/crt.h>

#include <nanobind/nanobind.h>

#include <exception>
#include <string_view>

namespace crt_python {

/// Makes crt::Error and crt::RenderFailed the exceptions of the package, `crt.Error` and `crt.RenderFailed`.
void bindErrors(nanobind::module_& module);
void bindScene(nanobind::module_& module);
void bindImage(nanobind::module_& module);
void bindFilm(nanobind::module_& module);
void bindRender(nanobind::module_& module);

/// Hears of one call of libcrt and tells Python: progress, stages and messages go to functions given from
/// Python, and Ctrl-C ends the call, as does an exception of one of those functions.
class Listener : public crt::Watch {
public:
    /// Each may be None.
    Listener(nanobind::object progress, nanobind::object stage, nanobind::object message);
    ~Listener() override;

    void progress(const crt::Progress& now) override;
    bool stop() override;
    void stage(std::string_view what) override;
    void message(crt::MessageLevel level, std::string_view text) override;

    /// Ctrl-C came. [with the interpreter's lock]
    bool interrupted() const { return interrupted_; }
    /// Raises what a function threw. [with the interpreter's lock]
    void raise() const;

private:
    /// Calls a function of Python; what it throws ends the call of libcrt.
    template <class... Arguments>
    void call(const nanobind::object& function, Arguments&&... arguments);

    nanobind::object progress_, stage_, message_;
    std::exception_ptr thrown_;
    double next_progress_seconds_ = 0;
    bool interrupted_ = false;
};

/// Runs `work(&listener)` without the interpreter's lock.
template <class Work>
auto listening(Listener& listener, const Work& work) {
    auto result = [&] {
        nanobind::gil_scoped_release release;
        return work(&listener);
    }();
    listener.raise();
    return result;
}

}  // namespace crt_python
