// The tables that are made of materials before rendering: each once, the same in any company, and not more
// than a scene may ask for.
#include "base/memo.h"
#include "base/program_identity.h"
#include "base/table_store.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "compile/coat.h"
#include "compile/compensation.h"
#include "compile/compile.h"
#include "compile/materials.h"
#include "file_bytes.h"
#include "scene/yaml/scene_yaml.h"
#include "scoped_variable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>

using namespace crt;

namespace {

Material rough(MaterialType type, double eta, double roughness) {
    Material m;
    m.type = type;
    m.eta = constantSpectrum(eta);
    m.k = constantSpectrum(type == MaterialType::RoughConductor ? 3 : 0);
    m.roughness = roughness;
    return m;
}

/// One of each kind of table.
std::vector<Material> oneOfEach() {
    std::vector<Material> all{
        rough(MaterialType::RoughConductor, 0.2, 0.4), rough(MaterialType::RoughDielectric, 1.5, 0.4),
        rough(MaterialType::RoughDielectric, 1.5, 0.3), rough(MaterialType::Plastic, 1.5, 0.3),
        rough(MaterialType::Plastic, 1.5, 0),          rough(MaterialType::RoughDielectric, 1.5, 0.5)};
    all[2].eta[100] = 1.51;
    all[3].diffuse_roughness = 0.5;
    all[5].film_thickness_nm = 100;
    all[5].film_index = constantSpectrum(1.3);
    Material clear = rough(MaterialType::Plastic, 1.5, 0.25);
    clear.clearcoat.emplace();
    clear.clearcoat->ior = 1.6;
    clear.clearcoat->roughness = 0.2;
    all.push_back(clear);
    return all;
}

std::vector<const Material*> addressesOf(const std::vector<Material>& materials) {
    std::vector<const Material*> all;
    for (const Material& m : materials) all.push_back(&m);
    return all;
}

double secondsFor(const std::vector<const Material*>& materials) {
    return tableWorkOf(materials).seconds();
}

/// Spheres of `count` materials, each by its number.
template <class Text>
std::string sceneOf(int count, const Text& material) {
    std::string text = "crt: 1\nfilm: {resolution: [8, 8]}\nenvironment: {radiance: 1}\nmaterials:\n";
    for (int i = 0; i < count; ++i) text += fmt::format("  m{}: {}\n", i, material(i));
    text += "objects:\n";
    for (int i = 0; i < count; ++i) text += fmt::format("- {{sphere: {{radius: 1}}, material: m{}}}\n", i);
    return text;
}

std::string refusal(const std::string& text) {
    try {
        compileScene(parseScene(text, "s.yaml", "."), 0);
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

}  // namespace

TEST_CASE("tables of equal materials cost once, and all of them something", "[compile][materials]") {
    const std::vector<Material> materials = oneOfEach();
    double sum = 0;
    for (const Material& m : materials) {
        const double alone = secondsFor({&m});
        CHECK(alone > 0);
        const Material same = m;
        CHECK(secondsFor({&m, nullptr, &same}) == alone);
        sum += alone;
    }
    CHECK(secondsFor(addressesOf(materials)) == Approx(sum));
}

TEST_CASE("a table does not depend on what else is made", "[compile][materials]") {
    const ScopedVariable no_folder("CRT_CACHE_DIR", "/dev/null");
    const std::vector<Material> materials = oneOfEach();
    std::vector<const Material*> twice = addressesOf(materials);
    const std::vector<Material> copies = materials;
    for (const Material& m : copies) twice.push_back(&m);
    const MaterialTables together = materialTablesOf(twice);
    for (const Material* m : twice) {
        forgetLossTables();  // Otherwise the tables would be compared with themselves.
        forgetCoats();
        const MaterialTables alone = materialTablesOf({m});
        CAPTURE(static_cast<int>(m->type), m->roughness);
        const Compensations &own = alone.compensations, &all = together.compensations;
        if (const auto found = own.table_of.find(m); found != own.table_of.end())
            CHECK(own.tables.at(found->second).rows == all.tables.at(all.table_of.at(m)).rows);
        for (const auto& [of, mean] : own.mean_reflectance) CHECK(all.mean_reflectance.at(of) == mean);
        for (const auto& [key, coat] : alone.coats) {
            CHECK(together.coats.at(key).albedo == coat.albedo);
            CHECK(together.coats.at(key).internal_reflectance == coat.internal_reflectance);
        }
        for (const auto& [of, base] : alone.rough_bases)
            CHECK(together.rough_bases.at(of).loss == base.loss);
    }
    // All of one kind share a table, those behind a film have one each.
    CHECK(together.compensations.tables.size() == 5);
}

TEST_CASE("a memo makes what it does not hold, once, and holds no more than it may",
          "[compile][materials]") {
    Memo<int, int> memo(3);
    std::vector<int> asked;
    const auto square = [&](const std::vector<int>& keys) {
        std::vector<int> squares;
        for (const int key : keys) {
            asked.push_back(key);
            squares.push_back(key * key);
        }
        return squares;
    };
    CHECK(memo.of({2, 3}, square) == std::vector{4, 9});
    CHECK(memo.of({3, 4, 2}, square) == std::vector{9, 16, 4});
    CHECK(asked == std::vector{2, 3, 4});
    CHECK(memo.of({}, square).empty());
    // A fourth is one too many: the three go.
    CHECK(memo.of({5}, square) == std::vector{25});
    CHECK(memo.of({5, 2}, square) == std::vector{25, 4});
    CHECK(asked == std::vector{2, 3, 4, 5, 2});
    memo.forget();
    CHECK(memo.of({5}, square) == std::vector{25});
    CHECK(asked.size() == 6);
    // More at once than it may hold are still all there.
    CHECK(memo.of({1, 2, 3, 4, 6, 7}, square) == std::vector{1, 4, 9, 16, 36, 49});
}

TEST_CASE("tables that are kept are those that would be made", "[compile][materials]") {
    const ScopedVariable no_folder("CRT_CACHE_DIR", "/dev/null");
    const std::vector<Material> materials = oneOfEach();
    // Differs from another one in a single input.
    std::vector<Material> others = materials;
    others[1].roughness = 0.41;
    others[5].film_thickness_nm = 101;
    others[6].clearcoat->ior = 1.61;
    forgetLossTables();
    forgetCoats();
    const MaterialTables first = materialTablesOf(addressesOf(materials));
    const MaterialTables beside = materialTablesOf(addressesOf(others));
    forgetLossTables();
    forgetCoats();
    const MaterialTables made = materialTablesOf(addressesOf(others));
    const auto rowsOf = [](const MaterialTables& tables, std::size_t i) {
        return tables.compensations.tables.at(i).rows;
    };
    REQUIRE(made.compensations.tables.size() == beside.compensations.tables.size());
    std::size_t differing = 0;
    for (std::size_t i = 0; i < made.compensations.tables.size(); ++i) {
        CHECK(rowsOf(made, i) == rowsOf(beside, i));
        differing += rowsOf(first, i) != rowsOf(made, i);
    }
    CHECK(differing == 2);
    for (const auto& [key, coat] : made.coats) CHECK(beside.coats.at(key).albedo == coat.albedo);
}

namespace {

/// All numbers of the tables of oneOfEach(), which the process has forgotten.
std::vector<double> numbersOfNewTables() {
    forgetLossTables();
    forgetCoats();
    const std::vector<Material> materials = oneOfEach();
    const MaterialTables tables = materialTablesOf(addressesOf(materials));
    std::vector<double> numbers;
    for (const LossTable& table : tables.compensations.tables)
        numbers.insert(numbers.end(), table.rows.begin(), table.rows.end());
    for (const auto& [key, coat] : tables.coats) {
        for (std::size_t i = 0; i < kSpectrumSize; ++i) numbers.push_back(coat.albedo[i]);
        numbers.push_back(coat.internal_reflectance);
    }
    return numbers;
}

/// A folder for tables, which is this process's cache.
struct TableFolder {
    TemporaryFolder folder;
    ScopedVariable variable{"CRT_CACHE_DIR", folder.path()};

    std::vector<std::filesystem::path> files() const {
        std::vector<std::filesystem::path> all;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
            all.push_back(entry.path());
        return all;
    }
};

}  // namespace

TEST_CASE("tables of materials on disk are read by the next run", "[compile][materials][cache]") {
    REQUIRE(buildId().size() >= 16);
    const TableFolder cache;
    const std::vector<double> made = numbersOfNewTables();
    // Four of losses, and three of coats: the smooth plastic has none.
    REQUIRE(cache.files().size() == 7);
    CHECK(numbersOfNewTables() == made);

    // A table that would not be made is there: so it was read.
    SpectrumValues::Array planted{};
    planted.fill(0.25);
    {
        TableStore store;
        store.store("albedos of coats", {1.6, 0.2}, &planted, sizeof planted);
        CHECK(cache.files().size() == 7);
    }
    const std::vector<double> read = numbersOfNewTables();
    CHECK(read != made);
    CHECK(std::count(read.begin(), read.end(), 0.25) >= static_cast<std::ptrdiff_t>(kSpectrumSize));
    // Kind and inputs say which table a file holds.
    CHECK(TableStore().path("a", {1, 2}) == TableStore().path("a", {1, 2}));
    CHECK(TableStore().path("a", {1, 2}) != TableStore().path("b", {1, 2}));
    CHECK(TableStore().path("a", {1, 2}) != TableStore().path("a", {2, 1}));
    // One of another size is made again, and replaced.
    TableStore().store("albedos of coats", {1.6, 0.2}, &planted, sizeof planted - 8);
    CHECK(numbersOfNewTables() == made);
    CHECK(numbersOfNewTables() == made);
    // Nothing is kept where there is no folder.
    const ScopedVariable no_folder("CRT_CACHE_DIR", "/dev/null");
    CHECK(TableStore().path("albedos of coats", {1.6, 0.2}).empty());
    CHECK(numbersOfNewTables() == made);
}

TEST_CASE("of several tables those are made that are not on disk", "[cache]") {
    const TableFolder cache;
    const auto made = [](const std::vector<double>& inputs) {
        std::vector<std::array<double, 2>> values(inputs.size());
        std::vector<WantedTable> wanted;
        for (std::size_t i = 0; i < inputs.size(); ++i)
            wanted.push_back({{inputs[i]}, std::as_writable_bytes(std::span(values[i]))});
        std::vector<double> made_of;
        TableStore().loadOrMake("pairs", wanted, [&](const std::vector<std::size_t>& missing) {
            for (const std::size_t i : missing) {
                values[i] = {inputs[i], -inputs[i]};
                made_of.push_back(inputs[i]);
            }
        });
        for (std::size_t i = 0; i < inputs.size(); ++i)
            CHECK(values[i] == std::array{inputs[i], -inputs[i]});
        return made_of;
    };
    CHECK(made({1, 2}) == std::vector<double>{1, 2});
    CHECK(made({2, 3, 1}) == std::vector<double>{3});
    CHECK(made({3, 2}).empty());
}

TEST_CASE("tables of materials on disk that are damaged or of others are made again",
          "[compile][materials][cache]") {
    namespace fs = std::filesystem;
    const TableFolder cache;
    const std::vector<double> made = numbersOfNewTables();
    const auto change = [](const fs::path& file, const std::function<void(std::string&)>& edit) {
        std::string bytes = slurp(file);
        edit(bytes);
        std::ofstream(file, std::ios::binary) << bytes;
    };
    const std::vector<std::function<void(const fs::path&)>> faults{
        [&](const fs::path& f) { change(f, [](std::string& bytes) { bytes[bytes.size() - 5] ^= 64; }); },
        [&](const fs::path& f) { change(f, [](std::string& bytes) { bytes.resize(bytes.size() / 2); }); },
        [&](const fs::path& f) { change(f, [](std::string& bytes) { bytes.clear(); }); },
        [&](const fs::path& f) { change(f, [](std::string& bytes) { bytes[9] ^= 1; }); },
        [](const fs::path& f) { fs::permissions(f, fs::perms::others_write, fs::perm_options::add); },
        [](const fs::path& f) {
            fs::remove(f);
            fs::create_directory(f);
        },
    };
    for (const auto& fault : faults) {
        for (const fs::path& file : cache.files()) fault(file);
        CHECK(numbersOfNewTables() == made);
    }
    // A table of another name is that of other inputs, or of another build.
    for (const fs::path& file : cache.files()) fs::remove_all(file);
    CHECK(numbersOfNewTables() == made);
    const std::vector<fs::path> files = cache.files();
    for (std::size_t i = 0; i < files.size(); ++i) fs::rename(files[i], files[i].string() + ".away");
    for (std::size_t i = 0; i < files.size(); ++i)
        fs::rename(files[i].string() + ".away", files[(i + 1) % files.size()]);
    CHECK(numbersOfNewTables() == made);
}

TEST_CASE("tables that take too long are refused with the place and what allows them",
          "[compile][materials][limits]") {
    const auto glass = [](int i) {
        return fmt::format("{{type: rough_dielectric, ior: {:.6f}, roughness: {:.6f}}}", 1.1 + i * 1e-5,
                           0.1 + i * 2e-5);
    };
    const auto kinds = {std::string("rough_dielectric, ior: 1.5, roughness: {0}, roughness_anisotropy: 0.5"),
                        std::string("plastic, reflectance: 0.5, roughness: {0}"),
                        std::string("rough_conductor, metal: gold, roughness: {0}")};
    CHECK_THAT(refusal(sceneOf(10'000, glass)), Contains("s.yaml:") && Contains("10000 rough materials") &&
                                                    Contains("set CRT_TABLE_SECONDS="));
    for (const std::string& kind : kinds) {
        CAPTURE(kind);
        const auto one = [&](int i) {
            return "{type: " + fmt::format(fmt::runtime(kind), 0.1 + i * 1e-4) + "}";
        };
        CHECK_THAT(refusal(sceneOf(4000, one)), Contains("set CRT_TABLE_SECONDS="));
        CHECK(refusal(sceneOf(4, one)).empty());
        CHECK(refusal(sceneOf(4000, [&](int) { return one(0); })).empty());
    }
    // A few are made however long they take, as models of glass have them.
    const auto slow = [](int i) {
        return fmt::format("{{type: rough_dielectric, ior: {{cauchy: [1.5, 0.01]}}, roughness: 0.{}, "
                           "roughness_anisotropy: 0.5}}",
                           200 + i);
    };
    for (const auto& [count, is_refused] : {std::pair{9, false}, {40, true}}) {
        const Scene scene = parseScene(sceneOf(count, slow), "s.yaml", ".");
        const TableWork work = tableWorkOf(addressesOf(scene.materials));
        CHECK(work.seconds() > kMostTableSeconds);
        if (is_refused)
            CHECK_THROWS_WITH(work.requireBounded(), Contains("set CRT_TABLE_SECONDS="));
        else
            CHECK_NOTHROW(work.requireBounded());
    }

    ::setenv("CRT_TABLE_SECONDS", "0.0001", 1);
    CHECK_THAT(refusal(sceneOf(1, glass)), Contains("s.yaml:5:"));
    ::setenv("CRT_TABLE_SECONDS", "soon", 1);
    CHECK_THAT(refusal(sceneOf(1, glass)), Contains("CRT_TABLE_SECONDS is 'soon'"));
    ::unsetenv("CRT_TABLE_SECONDS");
    CHECK(refusal(sceneOf(1, glass)).empty());
}
