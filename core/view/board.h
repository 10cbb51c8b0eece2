/// Where the threads of a view put what its pages show, and where pages wait for it.
#pragma once

#include "view/camera_moves.h"

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// The scale of a false-colour picture: a bar of colours with numbers at its ends.
struct ColourScale {
    std::string name{};        ///< The quantity; empty if the legend has it.
    double low = 0, high = 1;  ///< Values beyond them have the colours of the ends.
    std::string unit{};        ///< Empty: a pure number.
    bool logarithmic = false;
    std::vector<std::array<std::uint8_t, 3>> colours{};  ///< At equal distances, from low to high.
};

/// Eight-bit colours for a screen.
struct Picture {
    std::uint64_t number = 0;  ///< Given by the Board.
    std::uint32_t width = 0, height = 0;
    std::vector<std::uint8_t> rgba;  ///< [height][width][4], top row first.
    std::uint64_t samples = 0;       ///< Per pixel.
    unsigned divisor = 1;            ///< As of Snapshot.
    std::uint64_t run = 0;           ///< As of Snapshot.
    CameraPose pose;                 ///< From where.
    std::string plane;               ///< What it shows (planes.h).
    std::string legend;              ///< What its colours stand for; empty: they are colours.
    std::vector<ColourScale> scales;
};

/// An error of the image, known at some time of the render.
struct ErrorPoint {
    double seconds = 0, samples = 0, error = 0, lower = 0, upper = 0;
};

/// What there is to say beside the picture.
struct Status {
    std::string program;  ///< Another one each time that crt view starts.
    std::string file, title;
    std::string stage;  ///< Long work before samples: "reading bunny.obj". Empty: none.
    std::string
        scene_error;  ///< Why the scene cannot be read as it is; the picture is of the last that could.
    std::string render_error;           ///< Why nothing is rendered.
    std::vector<std::string> warnings;  ///< Of the scene that is shown.
    std::string backend, device;
    std::uint32_t width = 0, height = 0;  ///< Of the film's crop window; 0: there is no scene yet.
    std::uint64_t samples = 0, samples_wanted = 0;
    double seconds = 0, paths_per_second = 0;
    bool paused = false;
    bool has_lens = false;
    CameraPose pose;
    bool pose_moved = false, fov_moved = false;
    double exposure_ev = 0;
    std::string white;
    std::vector<std::string> whites;  ///< That can be chosen.
    std::string plane;
    std::vector<ErrorPoint> errors;  ///< Of this render, in order.
};

class Board {
public:
    /// Lets `change` change the status, and wakes whoever waits.
    void update(const std::function<void(Status&)>& change);
    void show(Picture picture);
    /// From now on nobody waits any more.
    void close();

    struct Sight {
        std::uint64_t version = 0;
        Status status;
        std::shared_ptr<const Picture> picture;  ///< Null: there is none yet.
        bool closed = false;
    };
    /// What there is, once it is newer than `version`, or else after the time.
    Sight waitBeyond(std::uint64_t version, std::chrono::milliseconds longest);
    Sight now() { return waitBeyond(0, {}); }
    /// Whether somebody has looked within the last seconds.
    bool isWatched();

private:
    std::mutex mutex_;
    std::condition_variable news_;
    std::uint64_t version_ = 1, pictures_ = 0;
    Status status_;
    std::shared_ptr<const Picture> picture_;
    std::chrono::steady_clock::time_point looked_at_{};
    bool closed_ = false;
};

}  // namespace crt
