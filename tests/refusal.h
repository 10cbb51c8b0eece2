/// Catches the errors of crt for tests.
#pragma once

#include "base/error.h"

#include <string>

namespace crt::test {

/// The sentence of the crt::Error that `work` throws; empty when it throws none.
template <class Work>
std::string refusal(const Work& work) {
    try {
        work();
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

}  // namespace crt::test
