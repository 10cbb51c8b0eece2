// Bins of wavelengths and responses of sensors: from the scene file to the film, its file and its images.
#include "base/temporary_folder.h"
#include "catch.h"
#include "compile/compile.h"
#include "film/checkpoint.h"
#include "film/resolve.h"
#include "image/image_io.h"
#include "render/outputs.h"
#include "render/session.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

using namespace crt;

namespace {

const std::string kInstruments =
    "spectral: {from_nm: 400, to_nm: 700, bins: 3}, responses: {red: {table: {nm: [600, 650, 700], value: "
    "[0, 1, 0]}, outside: zero}, flat: 2}";

Scene sceneWith(const std::string& film, const std::vector<SceneOverride>& overrides = {}) {
    return parseScene("crt: 1\nfilm: {resolution: [3, 2], " + film +
                          "}\nenvironment: {radiance: 1}\noutputs: [{file: a.exr, aovs: [error]}]\n",
                      "scene.yaml", ".", overrides);
}

/// Channel c of pixel p has the mean 100 p + c.
std::pair<Film, FilmIdentity> filmOf(const Scene& scene) {
    const CompiledScene compiled = compileScene(scene, 0);
    Film film(filmShapeOf(compiled));
    for (std::size_t p = 0; p < film.counts.size(); ++p) {
        film.counts[p] = 2;
        for (std::size_t c = 0; c < film.shape().channels; ++c)
            film.sums[(p * film.shape().channels + c) * 2] = 2 * static_cast<double>(100 * p + c);
    }
    film.samples.add({0, 2});
    return {std::move(film), {.scene_hash = compiled.hash, .version = "1", .record = recordOf(scene)}};
}

std::string errorOf(const std::string& film) {
    try {
        sceneWith(film);
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Scene);
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("a scene's bins and responses are as it says them", "[spectral]") {
    const SpectralFilm film = sceneWith(kInstruments).film.spectral;
    CHECK(film.bins == SpectralBins{400, 700, 3});
    CHECK(film.bins.centre_nm(1) == 550);
    REQUIRE(film.responses.size() == 2);
    CHECK(film.responses[0].name == "red");
    CHECK(film.responses[0].spectrum[265] == 0.5);
    CHECK(film.responses[1].spectrum == constantSpectrum(2));
    CHECK(film.normalise);
    CHECK_FALSE(sceneWith(kInstruments + ", normalise_responses: false").film.spectral.normalise);
    CHECK(sceneWith("spectral: null").film.spectral.bins.count == 0);
    // A view has no spectrum, and its film no channels for it.
    CHECK(spectralChannelsOf(sceneWith(kInstruments)).count() == 5);
    CHECK(spectralChannelsOf(sceneWith(kInstruments, {{"integrator.type", "normals"}})).count() == 0);
}

TEST_CASE("bins and responses that cannot be are refused where they stand", "[spectral]") {
    const auto refused = [](const std::string& film, const std::string& words) {
        const std::string what = errorOf(film);
        INFO(film << ": " << what);
        CHECK_THAT(what, Contains("scene.yaml:2:") && Contains(words));
    };
    refused("spectral: {from_nm: 700, to_nm: 400, bins: 3}", "exchange 'from_nm' and 'to_nm'");
    refused("spectral: {from_nm: 400, to_nm: 400, bins: 3}", "no wavelengths between");
    refused("spectral: {from_nm: 400, to_nm: 401, bins: 11}", "use at most 10");
    refused("spectral: {from_nm: 300, to_nm: 700, bins: 3}", "'from_nm' is 300; it must be 360 to 830");
    refused("spectral: {from_nm: 400, to_nm: 900, bins: 3}", "'to_nm' is 900; it must be 360 to 830");
    refused("spectral: {from_nm: 400, to_nm: 700, bins: 0}", "1 to 1024");
    refused("spectral: {from_nm: 400, to_nm: 700, bins: 100000}", "1 to 1024");
    refused("spectral: {from_nm: 400, to_nm: 700}", "'bins'");
    refused("spectral: {from: 400, to_nm: 700, bins: 3}", "from_nm");
    refused("responses: {dark: 0}", "is 0 at all wavelengths");
    refused("responses: {odd: -1}", "must be 0 to");
    refused("responses: {colour: {rgb: [1, 0, 0]}}", "not a colour");
    refused("responses: {'a.b': 1}", "letters, digits");
    refused("responses: {'a,b': 1}", "letters, digits");
    refused("responses: {there: is_none}", "there is no spectrum 'is_none'");
    refused("responses: [1, 2]", "expected a map");
    std::string many;
    for (int i = 0; i < 65; ++i) many += fmt::format("{}r{}: 1", i > 0 ? ", " : "", i);
    refused("responses: {" + many + "}", "at most 64 responses, and there are 65");
}

TEST_CASE("a film keeps its bins and responses in its file", "[spectral]") {
    const TemporaryFolder directory;
    const std::string path = directory / "a.crtfilm";
    const auto [film, identity] = filmOf(sceneWith(kInstruments));
    CHECK(film.shape().spectral == 5);
    writeCheckpoint(path, film, identity);
    const auto [back, back_identity] = readCheckpoint(path);
    CHECK(back.shape() == film.shape());
    CHECK(back.sums == film.sums);
    CHECK(back_identity.record->spectral == identity.record->spectral);
    // Only the record gives the meaning of its channels.
    FilmIdentity without = identity;
    without.record.reset();
    CHECK_THROWS_AS(writeCheckpoint(path, film, without), Error);
    FilmIdentity fewer = identity;
    fewer.record->spectral.responses.pop_back();
    CHECK_THROWS_AS(writeCheckpoint(path, film, fewer), Error);
}

TEST_CASE("a record with a spectral film that cannot be is refused", "[spectral]") {
    const std::string whole = recordText(recordOf(sceneWith(kInstruments)));
    const auto with = [&](const std::string& what, const std::string& instead) {
        std::string text = whole;
        REQUIRE(text.find(what) != std::string::npos);
        return text.replace(text.find(what), what.size(), instead);
    };
    CHECK_NOTHROW(readRecord(whole));
    CHECK_THROWS_AS(readRecord(with("\"bins\":3", "\"bins\":4000")), Error);
    CHECK_THROWS_AS(readRecord(with("\"bins\":3", "\"bins\":-3")), Error);
    CHECK_THROWS_AS(readRecord(with("\"from_nm\":400.0", "\"from_nm\":800.0")), Error);
    CHECK_THROWS_AS(readRecord(with("\"from_nm\"", "\"from\"")), Error);
    CHECK_THROWS_AS(readRecord(with("\"red\"", "\"r,d\"")), Error);
    CHECK_THROWS_AS(readRecord(with("[\"red\",\"flat\"]", "[\"red\",7]")), Error);
}

TEST_CASE("films that differ in bins or responses do not merge, and say in what", "[spectral]") {
    const auto refusal = [](const std::string& other) {
        auto merged = filmOf(sceneWith(kInstruments));
        const auto [film, identity] = filmOf(sceneWith(other));
        try {
            mergeFilm(merged, "a", film, identity, "b");
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK_THAT(refusal("exposure_ev: 0"), Contains("the spectral film is none, not 3 bins from 400 to "
                                                   "700 nm; responses: red, flat"));
    CHECK_THAT(refusal("spectral: {from_nm: 400, to_nm: 700, bins: 5}"), Contains("the spectral film is 5"));
    std::string other = kInstruments;
    other.replace(other.find("flat: 2"), 7, "flat: {table: {nm: [360, 830], value: [1, 2]}}");
    CHECK_THAT(refusal(other), Contains("the spectral film differs"));
}

TEST_CASE("an EXR has bins and responses beside the image, whatever it is developed to", "[spectral]") {
    const TemporaryFolder directory;
    auto [film, identity] = filmOf(sceneWith(kInstruments));
    identity.record->development.exposure_ev = 3;
    identity.record->development.apply_to_float = true;
    const auto image = [&, &film = film, &identity = identity](OutputFormat format) {
        return developedImage({.file = "a", .format = format, .aovs = kAovError, .place = {}}, film,
                              identity);
    };
    CHECK(image(OutputFormat::Pfm).channels.size() == 6);  // Three of colour, three of noise.
    const std::string path = directory / "a.exr";
    writeImage(path, OutputFormat::Exr, image(OutputFormat::Exr));
    const Image back = readImage(path);
    const std::uint32_t first = film.shape().firstSpectral();
    const char* const names[] = {"S0.450,000000nm", "S0.550,000000nm", "S0.650,000000nm", "Response.red",
                                 "Response.flat"};
    for (std::uint32_t c = 0; c < 5; ++c) {
        INFO(names[c]);
        const auto at = std::find(back.channels.begin(), back.channels.end(), names[c]);
        REQUIRE(at != back.channels.end());
        const auto index = static_cast<std::size_t>(at - back.channels.begin());
        for (std::size_t p = 0; p < 6; ++p)
            CHECK(back.pixels[p * back.channels.size() + index] ==
                  static_cast<float>(100 * p + first + c));
    }
    for (const char* name : {"R", "G", "B", "StdError.Y"})
        CHECK(std::count(back.channels.begin(), back.channels.end(), name) == 1);
    const auto value = [&](const std::string& key) {
        for (const auto& [name, text] : back.metadata)
            if (name == key) return text;
        return std::string();
    };
    CHECK(value("spectralLayoutVersion") == "1.0");
    CHECK(value("emissiveUnits") == "W.m^-2.sr^-1.nm^-1");
}
