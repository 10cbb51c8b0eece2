/// The one exception type of libcrt.
#pragma once

#include <crt/export.h>

#include <stdexcept>
#include <string>

CRT_API_NAMESPACE_BEGIN

/// The values are the exit codes of the program crt.
enum class ErrorKind : int {
    Internal = 1,  ///< A bug in crt, or a call that its description forbids.
    Usage = 2,     ///< An option or a file name is wrong, or a film does not fit.
    Scene = 3,     ///< The scene, or a file it names, is wrong.
    Backend = 4,   ///< Backend or device not available, or refused.
    Device = 5,    ///< The device failed while rendering.
    Output = 6,    ///< A file cannot be written.
};

/// The place of an error in an input file. `line` and `column` count from 1; 0 means unknown.
struct SourcePlace {
    std::string file;
    int line = 0;
    int column = 0;
};

/// what() is one sentence; of a scene with several errors, all of them, each as "file:line:column: error:
/// …". Beside it only std::bad_alloc leaves libcrt, and whatever a Watch throws.
class CRT_API Error : public std::runtime_error {
public:
    Error(ErrorKind kind, const std::string& sentence, SourcePlace place = {});
    ~Error() override;
    Error(const Error&);
    Error& operator=(const Error&);

    ErrorKind kind() const noexcept { return kind_; }
    /// The first error's; `file` is empty where there is none.
    const SourcePlace& place() const noexcept { return place_; }

private:
    ErrorKind kind_;
    SourcePlace place_;
};

CRT_API_NAMESPACE_END
