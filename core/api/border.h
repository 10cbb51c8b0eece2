/// Between libcrt's interface (core/include/crt, namespace crt::v0) and the rooms (namespace crt).
#pragma once

#include "base/error.h"
#include "base/listener.h"
#include "film/checkpoint.h"
#include "film/film.h"
#include "image/image.h"
#include "scene/scene.h"

#include <crt/crt.h>

#include <optional>
#include <utility>

namespace crt::api {

/// The calling thread's listener becomes the Watch, for as long as this lives; without a Watch there is
/// none, so that warnings go to stderr. A program's call must not end up with the listener of an outer one.
class Heard {
public:
    explicit Heard(v0::Watch* watch);

private:
    std::optional<Listener> listener_;
    std::optional<ListenerScope> scope_;
};

[[noreturn]] inline void throwPublic(const Error& error) {
    throw v0::Error(static_cast<v0::ErrorKind>(error.kind()), error.what(),
                    {error.place().file, error.place().line, error.place().column});
}

/// Runs `body`; an error of the rooms becomes one of the interface.
template <class Body>
auto acrossBorder(v0::Watch* watch, Body&& body) {
    const Heard heard(watch);
    try {
        return body();
    } catch (const Error& error) {
        throwPublic(error);
    }
}

}  // namespace crt::api

namespace crt::v0 {

struct Scene::Impl {
    crt::Scene scene;
};

struct Image::Impl {
    crt::Image image;
};

struct Film::Impl {
    std::pair<crt::Film, FilmIdentity> film;
};

}  // namespace crt::v0
