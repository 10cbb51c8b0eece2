/// Shows how far the work before the first sample is (base/stage.h).
#pragma once

#include "cli/progress.h"

#include <memory>

namespace crt {

/// Shows the innermost stage while it lives: on a terminal the line that rendering has too, in a log a line
/// for each stage that takes long and one every ten seconds. Work that is done at once is not mentioned.
class StageProgress {
public:
    explicit StageProgress(ProgressMode mode);
    ~StageProgress();
    StageProgress(const StageProgress&) = delete;
    StageProgress& operator=(const StageProgress&) = delete;

private:
    struct Shown;
    std::unique_ptr<Shown> shown_;
};

}  // namespace crt
