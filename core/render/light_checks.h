/// Warnings about light that gets nowhere.
#pragma once

#include "film/film.h"
#include "scene/scene.h"

#include <string>
#include <vector>

namespace crt {

/// Names of the objects that emit and light nothing: one-sided, with neither a vertex of the scene nor the
/// lens in front of any of their emitting faces. Exact but for rounding; empty for a scene in which looking
/// would take more than about a second.
std::vector<std::string> idleLamps(const Scene& scene);

/// One warning for each of them.
void warnOfIdleLamps(const Scene& scene);

/// Warns of light that the image lacks however long it renders (scene/missing_light.h, deep_glass.h).
void warnOfMissingLight(const Scene& scene);

/// Has no pixel got any light?
bool isBlack(const Film& film);

/// Warns of a picture that is black in 8 bits because its lights are thought to be kilometres away: the
/// scene is in millimetres and does not say so.
void warnOfLargeUnits(const Film& film, const Scene& scene);

/// Warns when no pixel of the film has got any light, with what may be the reason in this scene.
void warnOfBlackFilm(const Film& film, const Scene& scene);

}  // namespace crt
