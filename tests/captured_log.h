// Captures the log, for tests that check it.
#pragma once

#include "base/log.h"
#include "catch.h"
#include "base/temporary_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <string>

namespace crt::test {

/// Takes what goes to stderr while it lives, and counts warnings.
class CapturedLog {
public:
    CapturedLog() : file_(folder_ / "log"), warnings_before_(warningCount()), stderr_(::dup(STDERR_FILENO)) {
        const int to = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
        REQUIRE(to >= 0);
        ::dup2(to, STDERR_FILENO);
        ::close(to);
    }
    ~CapturedLog() {
        ::dup2(stderr_, STDERR_FILENO);
        ::close(stderr_);
    }
    CapturedLog(const CapturedLog&) = delete;
    CapturedLog& operator=(const CapturedLog&) = delete;

    int warnings() const { return warningCount() - warnings_before_; }
    std::string text() const {
        std::ifstream in(file_);
        return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    }

private:
    TemporaryFolder folder_;
    std::string file_;
    int warnings_before_, stderr_;
};

}  // namespace crt::test
