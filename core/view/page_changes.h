/// Records the changes of each page that were applied. Pages number their changes and send again those whose
/// reply was
/// lost: each counts once, in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crt {

class PageChanges {
public:
    /// False: this change of the page, or a later one, was taken before.
    bool take(const std::string& page, std::uint64_t number);

private:
    static constexpr std::size_t kMostPages = 64;

    std::vector<std::pair<std::string, std::uint64_t>> newest_;  ///< Of each page; the last one is in use.
};

}  // namespace crt
