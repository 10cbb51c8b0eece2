/// The command line: arguments → what one of job.h and commands.h takes → exit code. `--help` and
/// `--version` open no backend and no library.
#include "base/error.h"
#include "base/listener.h"
#include "base/log.h"
#include "base/standard_output.h"
#include "base/words.h"
#include "cli/arguments.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/terminal_watch.h"
#include "cli/verify_command.h"
#include "judge/converge/engine.h"
#include "judge/converge/reference.h"
#include "render/job.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace crt;

constexpr const char* kExamples = R"(
Examples:
  crt configs/cornell_box.yaml                        with the best backend there is
  crt --backend cuda configs/cornell_box.yaml         with this one; all give the same bits
  crt scene.yaml --spp 1024 -o a.exr -o a.png         more samples, into these files
  crt scene.yaml --time 30m                           as many samples as 30 minutes allow
  crt scene.yaml --target-error 1%                    as many as it takes for an error of 1 % of the mean
  crt scene.yaml --resume --spp 4096                  go on where Ctrl-C or a power cut stopped it
  crt scene.yaml --set film.resolution=[256,256] --set integrator.max_depth=4
  crt info scene.yaml                                 what a scene needs, and what is left out

Half of the samples here and half on another machine, then both together:
  crt scene.yaml --samples 0:512 -o a.crtfilm
  crt scene.yaml --samples 512:1024 -o b.crtfilm
  crt merge -o scene.exr a.crtfilm b.crtfilm

Another exposure without another render:
  crt develop a.crtfilm -o a.png --set film.exposure_ev=1
)";

constexpr const char* kExitCodes = R"(
Exit codes: 0 done, 1 internal error, 2 command line, 3 scene, 4 backend or device not available,
5 device failed (what there was is saved), 6 output not written, 7 images differ or a case of verify fails,
128 + n stopped by signal n, such as 130 by Ctrl-C and 143 by kill (image and checkpoint are saved).
)";

constexpr const char* kBackendGroup = "Backends instead of images";
constexpr const char* kCompareHelp = R"(
What is printed: whether the bits are the same; where the first difference is, with both values and how many
floats lie between them (ulp); errors over all values of R, G and B; what it looks like (FLIP, Delta E).
Where an image says how large its noise is (output AOV 'variance' or 'error', or a reference of 'crt
reference'), also whether the difference is noise or bias: the bias of each channel with its 99.9 %
interval, and how many tiles and pixels differ by more than noise would let any of them (alpha 0.1 %). One
NaN or infinity voids all of it: nothing is dropped.

With --backends, the scene is rendered with one seed by all, which crt's own backends do to the same bits,
and with other seeds for a verdict: PASS when the 99.9 % interval of the means' difference lies within
+-delta and no tile and no pixel differs by more than noise, FAIL when one does for certain, INCONCLUSIVE
when more samples are needed or one value carries too much of the error. The exit code is 7 unless all PASS.

Examples:
  crt compare cuda.exr embree.exr                        are they the same bits?
  crt compare --tolerance 0.01 --diff d.png a.exr b.exr  is the RMS difference below 1 % of b's mean?
  crt compare a.exr b.exr --map z.png                    where is the difference more than noise?
  crt compare a.exr b.exr --reference r.exr              which is nearer to r, and by how much?
  crt compare --backends cuda,embree scene.yaml          do both render the same?
)";

/// Usage lines as people write them, and on the top page the options of the command that needs no name.
class HelpFormatter : public CLI::Formatter {
public:
    explicit HelpFormatter(const CLI::App* render) : render_(render) { column_width(28); }

    std::string make_usage(const CLI::App* app, std::string) const override {
        if (app->get_parent() == nullptr)
            return "Usage: crt [render] SCENE [options]\n       crt COMMAND --help\n";
        std::string words;
        for (const CLI::Option* option :
             app->get_options([](const CLI::Option* o) { return o->get_positional(); }))
            words += " " + option->get_name(true) + (option->get_expected_max() > 1 ? "..." : "");
        return fmt::format("Usage: crt {}{} [options]\n",
                           app->get_name() == "render" ? "[render]" : app->get_name(), words);
    }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        if (app->get_parent() != nullptr) {
            return make_usage(app, name) + "\n" + make_description(app) + options(app, mode) +
                   app->get_footer();
        }
        return make_description(app) + "\n" + make_usage(app, name) + make_subcommands(app, mode) +
               options(render_, mode) + app->get_footer();
    }

private:
    /// CLI11 puts two empty lines between groups.
    std::string options(const CLI::App* app, CLI::AppFormatMode mode) const {
        return CLI::detail::find_and_replace(make_groups(app, mode), "\n\n\n", "\n\n");
    }

    const CLI::App* render_;
};

/// An option whose text is read by `read` once the whole command line is known to be well formed.
class Reader {
public:
    CLI::Option* option(CLI::App& app, const std::string& names, const char* placeholder, const char* help,
                        std::function<void(const std::string&)> read) {
        CLI::Option* o = app.add_option_function<std::vector<std::string>>(
                                names, [](const std::vector<std::string>&) {}, help)
                             ->option_text(placeholder)
                             ->expected(1)
                             ->allow_extra_args(false)
                             ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
        pending_.emplace_back(o, std::move(read));
        return o;
    }

    /// The same, for one that may be given more than once.
    CLI::Option* repeatable(CLI::App& app, const std::string& names, const char* placeholder,
                            const char* help, std::function<void(const std::string&)> read) {
        return option(app, names, placeholder, help, std::move(read))
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    }

    /// Reads the values given, in the order of definition. Throws crt::Error(Usage).
    void readAll() const {
        for (const auto& [option, read] : pending_)
            for (const std::string& value : option->results()) read(value);
    }

private:
    std::vector<std::pair<CLI::Option*, std::function<void(const std::string&)>>> pending_;
};

class CommandLine {
public:
    CommandLine() {
        app_.set_version_flag("--version", "crt " CRT_VERSION);
        app_.require_subcommand(1);
        CLI::App* render = addRender();
        addInfo();
        addCompare();
        addMerge();
        addDevelop();
        addConverge();
        addReference();
        addVerify();
        addPlugins();
        addSchema();
        app_.footer(std::string(kExamples) +
                    kExitCodes);  // Now: commands inherit what is there when they are added.
        const auto formatter = std::make_shared<HelpFormatter>(render);
        app_.formatter(formatter);
        for (CLI::App* command : app_.get_subcommands({})) command->formatter(formatter);
    }

    int run(const std::vector<std::string>& words) {
        std::vector<std::string> commands;
        for (const CLI::App* command : app_.get_subcommands({})) commands.push_back(command->get_name());
        const std::vector<std::string> arguments = writtenOut({words.begin() + 1, words.end()}, commands);
        if (arguments.empty())
            throw Error(ErrorKind::Usage,
                        "there is no scene to render; try 'crt configs/cornell_box.yaml', or 'crt --help'");
        try {
            app_.parse(std::vector<std::string>(arguments.rbegin(),
                                                arguments.rend()));  // CLI11 takes them from the back.
        } catch (const CLI::CallForHelp&) {
            printOut("{}",
                     (app_.get_subcommands().empty() ? &app_ : app_.get_subcommands().front())->help());
            return 0;
        } catch (const CLI::CallForVersion& version) {
            printOut("{}\n", version.what());
            return 0;
        } catch (const CLI::ParseError& error) {
            refuse(error);
        }
        reader_.readAll();
        job_.command = shellLine(words);
        return action_();
    }

private:
    /// CLI11 knows what is wrong, but not what was meant. Options come first: with one misspelt, the words
    /// after it are misread too.
    [[noreturn]] void refuse(const CLI::ParseError& error) {
        const CLI::App* command = app_.get_subcommands().empty() ? &app_ : app_.get_subcommands().front();
        const std::string place = command == &app_ ? "crt" : "crt " + command->get_name();
        const std::vector<std::string> left = app_.remaining(true);
        for (const std::string& word : left) {
            if (word.size() < 2 || word[0] != '-') continue;
            const std::string flag = word.substr(0, word.find('='));
            std::vector<std::string> names;
            for (const CLI::Option* option : command->get_options()) {
                for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
                for (const std::string& name : option->get_snames()) names.push_back("-" + name);
            }
            const std::string hint = didYouMean(flag, names);
            throw Error(ErrorKind::Usage,
                        fmt::format("{} has no option '{}'{}", place, flag,
                                    hint.empty() ? "; see '" + place + " --help'" : "; " + hint));
        }
        if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && !left.empty())
            throw Error(ErrorKind::Usage,
                        command->get_name() == "render"
                            ? fmt::format("one scene at a time: '{}' is one too many", left.front())
                            : fmt::format("{} does not know what to do with '{}'", place, left.front()));
        if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
            const std::string text = error.what();  // "--spp: 1 required TEXT missing"
            throw Error(ErrorKind::Usage, fmt::format("{} needs a value; see '{} --help'",
                                                      text.substr(0, text.find(':')), place));
        }
        throw Error(ErrorKind::Usage, fmt::format("{}; see '{} --help'", error.what(), place));
    }

    CLI::App* addCommand(const char* name, const char* help, std::function<int()> action) {
        CLI::App* command = app_.add_subcommand(name, help);
        command->set_help_flag("-h,--help", "this page");
        command->callback([this, action = std::move(action)] { action_ = action; });
        return command;
    }

    void addSceneChanges(CLI::App& command, SceneRequest& scene, const char* group) {
        reader_
            .repeatable(
                command, "--set", "KEY=VALUE",
                "change the scene, e.g. film.resolution=[256,256]; repeatable",
                [&scene](const std::string& text) { scene.overrides.push_back(parseOverride(text)); })
            ->group(group);
        reader_.option(command, "--seed", "N", "another seed: other, equally good, noise",
                       [&scene](const std::string& text) { scene.seed = parseCount(text, "--seed", 0); })
            ->group(group);
        reader_.option(command, "--crop", "X0,Y0,X1,Y1", "only these pixels of the film, X1 and Y1 excluded",
                       [&scene](const std::string& text) { scene.crop = parseRectangle(text, "--crop"); })
            ->group(group);
    }

    CLI::App* addRender() {
        CLI::App* render = addCommand("render", "render a scene; the word may be left out", [this] {
            TerminalWatch watch(progress_);
            return runJob(job_, watch);
        });
        render->add_option("SCENE", job_.scene.file, "scene file (YAML), or - for standard input")
            ->required();

        const char* group = "What is rendered";
        CLI::Option* spp =
            reader_.option(*render, "--spp", "N", "samples per pixel, instead of the scene's",
                           [this](const std::string& text) { job_.spp = parseCount(text, "--spp", 1); });
        spp->group(group);
        reader_
            .option(
                *render, "--time", "DURATION",
                "stop after 90s, 30m, 2h, 1h30m; with --spp, whichever comes first",
                [this](const std::string& text) { job_.time_limit_seconds = parseDuration(text, "--time"); })
            ->group(group);
        reader_
            .option(*render, "--target-error", "PERCENT",
                    "stop when the image's error is below, e.g. 1%, with 95 % confidence",
                    [this](const std::string& text) {
                        job_.target_error = parseFraction(text, "--target-error");
                    })
            ->group(group);
        reader_
            .option(*render, "--samples", "A:B", "exactly the samples A to B-1: a part to merge with others",
                    [this](const std::string& text) { job_.samples = parseSampleRange(text, "--samples"); })
            ->group(group)
            ->excludes(spp);
        addSceneChanges(*render, job_.scene, group);

        group = "Where";
        reader_
            .option(*render, "-b,--backend", "NAME",
                    "cuda, embree, opencl, another, a path of one, or auto (CRT_BACKEND)",
                    [this](const std::string& text) { job_.backend = text; })
            ->envname("CRT_BACKEND")
            ->group(group);
        reader_
            .option(*render, "-d,--device", "NAME",
                    "number or part of the name, as 'crt plugins' lists them (CRT_DEVICE)",
                    [this](const std::string& text) { job_.integrator.device = text; })
            ->envname("CRT_DEVICE")
            ->group(group);
        reader_
            .option(*render, "-t,--threads", "N", "threads of the processor; 0 for all",
                    [this](const std::string& text) {
                        job_.integrator.threads = smallCount(text, "--threads", 0);
                    })
            ->group(group);
        reader_.option(*render, "--kernel", "KIND",
                       "lean: only what the scene needs; full; lean-only: waits for the compiler; same bits",
                       [this](const std::string& text) {
                           job_.integrator.kernel = text == "full"        ? CRT_KERNEL_FULL
                                                    : text == "lean-only" ? CRT_KERNEL_LEAN_ONLY
                                                                          : CRT_KERNEL_LEAN;
                       })
            ->check(oneOf({"lean", "full", "lean-only"}))
            ->group(group);
        reader_
            .option(*render, "--tile", "N", "pixels along the side of a tile; never changes the image",
                    [this](const std::string& text) {
                        job_.integrator.tile_size = smallCount(text, "--tile", 1);
                    })
            ->group(group);
        reader_.option(*render, "--chunk", "N", "samples per pixel between two looks at clock and signals",
                       [this](const std::string& text) { job_.chunk = parseCount(text, "--chunk", 1); })
            ->group(group);
        render
            ->add_flag_callback(
                "--no-cache", [this] { job_.integrator.use_cache = false; },
                "keep no compiled kernels on disk")
            ->group(group);

        group = "Files";
        reader_
            .repeatable(*render, "-o,--output", "FILE",
                        ".exr .png .ppm .pfm or .crtfilm, instead of the scene's; repeatable",
                        [this](const std::string& text) { job_.outputs.push_back(text); })
            ->group(group);
        reader_
            .option(*render, "--checkpoint", "FILE",
                    "save the samples at the end and now and then, for --resume; or off",
                    [this](const std::string& text) { job_.checkpoint_file = text == "off" ? "" : text; })
            ->group(group);
        reader_
            .option(*render, "--checkpoint-every", "DURATION", "how often (10m)",
                    [this](const std::string& text) {
                        job_.checkpoint_interval_seconds = parseDuration(text, "--checkpoint-every");
                    })
            ->group(group);
        reader_
            .option(*render, "--resume", "[FILE]",
                    "go on from a checkpoint (FILE.crtfilm, or the first output's), and keep it",
                    [this](const std::string& text) {
                        job_.resume = true;
                        job_.resume_file = text == "auto" ? "" : text;
                    })
            ->group(group);
        render
            ->add_flag("--overwrite", job_.overwrite,
                       "replace a film even where it holds more samples than this run makes")
            ->group(group);
        reader_
            .option(*render, "--report", "FILE",
                    "what the run did, as JSON (first output with .report.json); or none",
                    [this](const std::string& text) { job_.report_file = text == "none" ? "" : text; })
            ->group(group);

        group = "Messages";
        render
            ->add_flag_callback(
                "-v,--verbose", [] { setLogLevel(LogLevel::Debug); }, "say more")
            ->group(group);
        render
            ->add_flag_callback(
                "-q,--quiet", [this] { beQuiet(); }, "only warnings and errors, no progress")
            ->group(group);
        render->set_help_flag();  // Taken away and added again, so that it comes last.
        render->set_help_flag("-h,--help", "this page")->group(group);
        render->footer(kExamples);
        return render;
    }

    void addInfo() {
        CLI::App* info = addCommand("info", "say what a scene needs, or what a .crtfilm or an image holds",
                                    [this] { return showInfo(info_); });
        info->add_option("FILE", info_.file, "scene, film or image")->required();
        addSceneChanges(*info, info_, "Options");
    }

    void addCompare() {
        CLI::App* compare =
            addCommand("compare", "compare two images, or backends; exit code 7 when they differ",
                       [this] { return crt::compare(compare_); });
        compare->footer(kCompareHelp);
        compare->add_option("A", compare_.first, "image; with --backends a scene")->required();
        compare->add_option("B", compare_.second, "image; relative numbers are relative to it");
        const char* group = "Same or not (exit code)";
        reader_
            .option(*compare, "--tolerance", "X",
                    "RMS difference, as a share of B's mean, that counts as equal (0: same bits)",
                    [this](const std::string& text) {
                        compare_.options.tolerance = parseTolerance(text, "--tolerance");
                    })
            ->group(group);
        compare
            ->add_flag("--all-channels", compare_.options.all_channels,
                       "compare every channel, not only R, G and B")
            ->group(group);
        group = "More to see";
        reader_
            .option(*compare, "--reference", "FILE", "errors of A and of B against this image, side by side",
                    [this](const std::string& text) { compare_.reference = text; })
            ->group(group);
        reader_
            .option(*compare, "--diff", "FILE",
                    "write the difference: values to .exr or .pfm, colours to .png or .ppm",
                    [this](const std::string& text) { compare_.difference_file = text; })
            ->group(group);
        reader_
            .option(*compare, "--map", "FILE",
                    "write z, the difference in standard errors: values to .exr or .pfm, else colours",
                    [this](const std::string& text) { compare_.map_file = text; })
            ->group(group);
        reader_
            .option(*compare, "--json", "[FILE]",
                    "all numbers as JSON: into FILE.json too, or instead of the text",
                    [this](const std::string& text) { compare_.json_file = text; })
            ->group(group);
        addBackendComparison(*compare);
        compare->set_help_flag();  // Taken away and added again, so that it comes last.
        compare->set_help_flag("-h,--help", "this page")->group(kBackendGroup);
    }

    void addBackendComparison(CLI::App& compare) {
        const char* group = kBackendGroup;
        BackendComparisonOptions& options = compare_.backends;
        CLI::Option* backends = reader_.option(
            compare, "--backends", "X,Y",
            "render scene A with each; the last is what the others are compared with",
            [&options](const std::string& text) { options.backends = parseList(text, "--backends"); });
        backends->group(group);
        reader_
            .option(compare, "--spp", "N",
                    "samples per pixel of each render (so many that all replicates have the scene's)",
                    [&options](const std::string& text) { options.samples = parseCount(text, "--spp", 1); })
            ->group(group)
            ->needs(backends);
        reader_
            .option(compare, "--replicates", "R",
                    "renders of each backend, every one with its own seed (16)",
                    [&options](const std::string& text) {
                        options.replicates = smallCount(text, "--replicates", 2);
                    })
            ->group(group)
            ->needs(backends);
        reader_
            .option(
                compare, "--delta", "PERCENT", "means that differ by less are equivalent (1%)",
                [&options](const std::string& text) { options.gate.delta = parseFraction(text, "--delta"); })
            ->group(group)
            ->needs(backends);
        addSceneChanges(compare, compare_.scene, group);
        compare
            .add_flag_callback(
                "-q,--quiet", [this] { compare_.progress = ProgressMode::None; }, "no progress")
            ->group(group);
    }

    void addMerge() {
        CLI::App* merge = addCommand("merge", "add partial renders of disjoint samples",
                                     [this] { return mergeFilms(merge_); });
        merge->footer(
            "\nExamples:\n"
            "  crt merge -o all.crtfilm a.crtfilm b.crtfilm\n"
            "  crt merge -o scene.exr -o scene.png a.crtfilm b.crtfilm\n"
            "  crt merge --scene scene.yaml -o scene.exr a.crtfilm b.crtfilm      films of an earlier crt, "
            "which need it\n");
        merge->add_option("PART", merge_.parts, "films (.crtfilm) of one scene")->required();
        reader_
            .repeatable(*merge, "-o,--output", "FILE",
                        ".crtfilm, or an image (.exr .png .ppm .pfm); repeatable",
                        [this](const std::string& text) { merge_.outputs.push_back(text); })
            ->required();
        reader_.option(*merge, "--scene", "SCENE",
                       "the scene they are of: only for films that do not know how to develop them",
                       [this](const std::string& text) { merge_.scene.file = text; });
        addSceneChanges(*merge, merge_.scene, "The scene, changed as it was for rendering");
        merge->add_flag("--overwrite", merge_.overwrite, "replace a film even where it holds more samples");
        merge->add_flag_callback("-q,--quiet", [this] { beQuiet(); }, "only warnings and errors");
    }

    void addDevelop() {
        CLI::App* command = addCommand(
            "develop", "make images of a film again, with other exposure, white balance, colours or crop",
            [this] { return develop(develop_); });
        command->footer(
            "\nA film (.crtfilm, from -o or --checkpoint) holds every sample's sum, so exposure, white "
            "balance, colour space and crop can be\n"
            "chosen after the render. No backend is opened and no scene is read. PNG and PPM get exposure "
            "and white balance; EXR and PFM\n"
            "hold the radiance of the scene unless film.apply_to_float is true. Several films of disjoint "
            "samples are added up, as by merge.\n"
            "\nKeys of --set:\n"
            "  film.exposure_ev=1.5                 stops\n"
            "  film.white_balance=lamp              a named light of the scene, an illuminant (A, D50, D65, "
            "F2, F7, F11),\n"
            "                                       a spectrum such as {blackbody: 3200}, or null for none\n"
            "  film.color_space=acescg              srgb, acescg or xyz\n"
            "  film.crop=[0,0,256,256]              the same as --crop 0,0,256,256\n"
            "  film.apply_to_float=true             exposure and white balance in EXR and PFM too\n"
            "\nExamples:\n"
            "  crt scene.yaml -o scene.crtfilm                                       render once\n"
            "  crt develop scene.crtfilm -o a.png --set film.exposure_ev=1           one stop brighter\n"
            "  crt develop scene.crtfilm -o b.png --set film.white_balance=D50\n"
            "  crt develop scene.crtfilm -o c.exr -o c.png --crop 100,50,300,250\n"
            "  crt develop scene.crtfilm -o d.exr --aovs albedo,normal,error,samples\n"
            "  crt develop a.crtfilm b.crtfilm -o both.exr                           two halves of the "
            "samples\n");
        command->add_option("FILM", develop_.films, "films (.crtfilm) of one scene")->required();
        reader_.repeatable(*command, "-o,--output", "FILE", ".exr .png .ppm or .pfm; repeatable",
                           [this](const std::string& text) { develop_.outputs.push_back(text); })
            ->required();
        reader_.repeatable(
            *command, "--set", "KEY=VALUE",
            "change how it is developed, e.g. film.exposure_ev=1; repeatable",
            [this](const std::string& text) { develop_.changes.push_back(parseOverride(text)); });
        reader_.option(*command, "--crop", "X0,Y0,X1,Y1",
                       "only these pixels of the film, X1 and Y1 excluded",
                       [this](const std::string& text) { develop_.crop = parseRectangle(text, "--crop"); });
        reader_.option(*command, "--aovs", "A,B",
                       "what .exr files hold beside the image (what the scene asks for), or none",
                       [this](const std::string& text) { develop_.aovs = parseList(text, "--aovs"); });
        command->add_flag_callback("-q,--quiet", [this] { beQuiet(); }, "only warnings and errors");
    }

    void addConverge() {
        CLI::App* command = addCommand(
            "converge", "measure error against run time; exit code 7 when a backend is wrong", [this] {
                for (const std::string& file : converge_files_) {
                    SceneRequest scene = converge_scene_;
                    scene.file = file;
                    converge_.scenes.push_back(std::move(scene));
                }
                converge_.command = job_.command;
                TerminalWatch watch(progress_, TerminalWatch::Signals::Always);
                return converge::converge(converge_, watch);
            });
        command->footer(
            "\nRenders every scene with every backend and variant, again and again with other seeds, looks "
            "at 1, 2, 4 ... samples, and writes one\n"
            "page: error against seconds with its interval, efficiency, bias, whether the images' own error "
            "estimates hold, where the time goes.\n"
            "Where no --reference is given, a quarter of --time makes one.\n"
            "docs/error.md explains the terms.\n"
            "\nExamples:\n"
            "  crt converge configs/cornell_box.yaml --backends embree,opencl --time 60 -o converge_box\n"
            "  crt converge scene.yaml --vary sampler=sobol,independent --vary nee=true,false --reference "
            "ref.exr\n"
            "  crt converge configs/analytic/direct_light.yaml --reference 0.2394564705\n"
            "  crt converge a.yaml b.yaml c.yaml --time 10m -o night       then, cut short: the same with "
            "--resume\n");
        command->add_option("SCENE", converge_files_, "scene files (YAML)")->required();
        const char* group = "What is measured";
        reader_
            .option(*command, "--backends", "X,Y",
                    "of these; one that cannot run is left out and named (embree,opencl,cuda)",
                    [this](const std::string& text) { converge_.backends = parseList(text, "--backends"); })
            ->group(group);
        reader_
            .repeatable(
                *command, "--vary", "KEY=A,B",
                "each value, and each combination: sampler, replicates, nee, roulette, depth, accelerator, "
                "filter,\n"
                "or any key of the scene; repeatable",
                [this](const std::string& text) { converge_.vary.push_back(converge::parseVary(text)); })
            ->group(group);
        reader_
            .repeatable(*command, "--reference", "FILE",
                        "of 'crt reference', for the scene it is of; or a number, the luminance of every "
                        "pixel; repeatable",
                        [this](const std::string& text) { converge_.references.push_back(text); })
            ->group(group);
        reader_
            .option(*command, "--time", "DURATION", "for everything (60s)",
                    [this](const std::string& text) { converge_.seconds = parseDuration(text, "--time"); })
            ->group(group);
        reader_
            .option(*command, "--replicates", "R", "seeds of each, at least (16); more where there is time",
                    [this](const std::string& text) {
                        converge_.replicates = smallCount(text, "--replicates", 2);
                    })
            ->group(group);
        reader_
            .option(*command, "--max-spp", "N", "no more samples per pixel than this",
                    [this](const std::string& text) {
                        converge_.max_samples = parseCount(text, "--max-spp", 1);
                    })
            ->group(group);
        reader_
            .option(*command, "--resolution", "N",
                    "longer side in pixels, where --set film.resolution does not say (128); 0: the scene's",
                    [this](const std::string& text) {
                        converge_.resolution = static_cast<int>(smallCount(text, "--resolution", 0));
                    })
            ->group(group);
        addSceneChanges(*command, converge_scene_, group);
        group = "Where";
        reader_
            .option(*command, "-d,--device", "NAME",
                    "number or part of the name, as 'crt plugins' lists them (CRT_DEVICE)",
                    [this](const std::string& text) { converge_.integrator.device = text; })
            ->envname("CRT_DEVICE")
            ->group(group);
        reader_
            .option(*command, "-t,--threads", "N", "threads of the processor; 0 for all",
                    [this](const std::string& text) {
                        converge_.integrator.threads = smallCount(text, "--threads", 0);
                    })
            ->group(group);
        reader_
            .option(*command, "-o,--output", "DIR", "folder for report.html, results and figures (converge)",
                    [this](const std::string& text) { converge_.output = text; })
            ->group(group);
        command
            ->add_flag("--resume", converge_.resume,
                       "go on with the run in that folder, of the same experiment")
            ->group(group);
        command
            ->add_flag_callback(
                "-q,--quiet", [this] { progress_ = ProgressMode::None; }, "no progress")
            ->group(group);
    }

    void addReference() {
        CLI::App* command = addCommand(
            "reference", "render an independent reference for 'crt converge' and 'crt compare'", [this] {
                TerminalWatch watch(progress_, TerminalWatch::Signals::Always);
                return converge::makeReference(reference_, watch);
            });
        command->footer(
            "\nAnother seed, independent samples, no roulette, and light sampling switched: as little as "
            "possible in common with what it will judge.\n"
            "The file holds the mean and eight independent eighths of it, from which its own error "
            "follows.\n"
            "\nExamples:\n"
            "  crt reference scene.yaml -o ref.exr --time 10m\n"
            "  crt reference scene.yaml -o ref.exr --spp 65536 --same-estimator --set "
            "film.resolution=[128,128]\n");
        command->add_option("SCENE", reference_.scene.file, "scene file (YAML)")->required();
        const char* group = "Options";
        reader_
            .option(*command, "-o,--output", "FILE", ".exr",
                    [this](const std::string& text) { reference_.output = text; })
            ->required()
            ->group(group);
        reader_
            .option(*command, "--spp", "N", "samples per pixel, instead of --time",
                    [this](const std::string& text) { reference_.samples = parseCount(text, "--spp", 8); })
            ->group(group);
        reader_
            .option(*command, "--time", "DURATION", "about this long (60s)",
                    [this](const std::string& text) { reference_.seconds = parseDuration(text, "--time"); })
            ->group(group);
        command
            ->add_flag("--same-estimator", reference_.same_estimator,
                       "keep integrator.nee: much less noise in scenes with small lamps")
            ->group(group);
        reader_
            .option(*command, "-b,--backend", "NAME",
                    "cuda, embree, opencl, another, a path of one, or auto (CRT_BACKEND)",
                    [this](const std::string& text) { reference_.backend = text; })
            ->envname("CRT_BACKEND")
            ->group(group);
        addSceneChanges(*command, reference_.scene, group);
        command
            ->add_flag_callback(
                "-q,--quiet", [this] { progress_ = ProgressMode::None; }, "no progress")
            ->group(group);
    }

    void addVerify() {
        CLI::App* command = addCommand(
            "verify", "render scenes whose answer is known; exit code 7 when a backend does not find it",
            [this] { return verify::verify(verify_); });
        command->footer(
            "\nThe suite asks a backend what physics, geometry and arithmetic demand: closed forms, "
            "deterministic quadrature, relations between\n"
            "images. A case passes, is refused as documented, does not apply (and says why), is "
            "INCONCLUSIVE (the noise hides the answer) or\n"
            "FAILS; the last two make the exit code 7, and the line below says what the figures suggest. "
            "docs/stability.md describes every case.\n"
            "\nExamples:\n"
            "  crt verify                                          the level for every commit, on the best "
            "backend\n"
            "  crt verify --backend opencl --level merge -o out    minutes of it, with out/verify.html and "
            "out/verify.json\n"
            "  crt verify --case furnace,A03,H                     two cases and a whole group\n"
            "  crt verify --backend mine --plugin-path build       a backend of your own\n"
            "  crt verify --list --level nightly                   everything there is\n");
        const char* group = "What is asked";
        reader_
            .repeatable(*command, "--case", "NAME",
                        "only these: ids (A03), names (furnace), groups (H), with commas or repeated",
                        [this](const std::string& text) { verify_.cases.push_back(text); })
            ->group(group);
        reader_
            .option(*command, "--level", "LEVEL",
                    "commit (a minute or so), merge (a quarter of an hour) or nightly",
                    [this](const std::string& text) { verify_.level = *verify::levelNamed(text); })
            ->check(oneOf({"commit", "merge", "nightly"}))
            ->group(group);
        command->add_flag("--list", verify_.list, "show the cases and run nothing")->group(group);
        group = "Of whom";
        reader_
            .option(*command, "-b,--backend", "NAME",
                    "cuda, embree, opencl, another, a path of one, or auto (CRT_BACKEND)",
                    [this](const std::string& text) { verify_.backend = text; })
            ->envname("CRT_BACKEND")
            ->group(group);
        reader_.option(*command, "--plugin-path", "DIR", "look for the backend here first",
                       [this](const std::string& text) { verify_.plugin_path = text; })
            ->group(group);
        reader_
            .option(*command, "-d,--device", "NAME",
                    "number or part of the name, as 'crt plugins' lists them (CRT_DEVICE)",
                    [this](const std::string& text) { verify_.integrator.device = text; })
            ->envname("CRT_DEVICE")
            ->group(group);
        reader_
            .option(*command, "-t,--threads", "N", "threads of the processor; 0 for all",
                    [this](const std::string& text) {
                        verify_.integrator.threads = smallCount(text, "--threads", 0);
                    })
            ->group(group);
        group = "Output";
        reader_.option(*command, "-o,--output", "DIR", "write verify.json and verify.html there",
                       [this](const std::string& text) { verify_.output = text; })
            ->group(group);
        command->add_flag("-q,--quiet", verify_.quiet, "only what fails, and the summary")->group(group);
        command->add_flag("--markdown", verify_.markdown, "print docs/stability.md instead")->group(group);
        reader_
            .repeatable(*command, "--figures", "FILE",
                        "with --markdown: a verify.json whose figures go into it; repeatable",
                        [this](const std::string& text) { verify_.suites.push_back(text); })
            ->group(group);
    }

    void addPlugins() {
        addCommand("plugins", "list the backends, their devices, and why one cannot run",
                   [] { return listPlugins(); });
    }

    void addSchema() {
        CLI::App* schema = addCommand("schema", "print the JSON Schema of scene files",
                                      [this] { return printSchema(markdown_); });
        schema->add_flag("--markdown", markdown_, "print the reference manual instead");
    }

    void beQuiet() {
        setLogLevel(LogLevel::Warning);
        progress_ = ProgressMode::None;
    }

    static unsigned smallCount(const std::string& text, const char* option, std::uint64_t least) {
        const std::uint64_t n = parseCount(text, option, least);
        if (n > 65536) throw Error(ErrorKind::Usage, fmt::format("{} {} is beyond any use", option, text));
        return static_cast<unsigned>(n);
    }

    static CLI::Validator oneOf(std::vector<std::string> choices) {
        return CLI::Validator(
            [words = std::move(choices)](std::string& text) {
                if (std::find(words.begin(), words.end(), text) != words.end()) return std::string();
                const std::string hint = didYouMean(text, words);
                return fmt::format("takes one of {}, not '{}'{}", fmt::join(words, ", "), text,
                                   hint.empty() ? "" : "; " + hint);
            },
            "");
    }

    CLI::App app_{
        "crt, a spectral path tracer. The same scene and seed give the same bits on every backend."};
    Reader reader_;
    std::function<int()> action_;
    Job job_;
    ProgressMode progress_ = ProgressMode::Auto;
    SceneRequest info_;
    CompareArguments compare_;
    MergeArguments merge_;
    DevelopArguments develop_;
    verify::Arguments verify_;
    converge::ConvergeRequest converge_;
    converge::ReferenceRequest reference_;
    SceneRequest converge_scene_;          ///< What is changed in every scene of converge_.
    std::vector<std::string> converge_files_;
    bool markdown_ = false;
};

}  // namespace

int main(int argc, char** argv) {
    crt::openClosedStreams();
    crt::ignoreWriteSignals();
    const crt::Listener listener(crt::standardErrorSink());
    const crt::ListenerScope scope(listener);
    // One place turns everything that can be thrown into one line and an exit code.
    try {
        CommandLine command_line;
        const int code = command_line.run({argv, argv + argc});
        if (const std::optional<crt::Error> lost = crt::finishStandardOutput()) throw *lost;
        return code;
    } catch (const crt::Error& error) {
        const std::string text = error.what();
        // Errors in a scene come with places of their own, which editors find only at the start of a line.
        const bool has_places = text.find(": error: ") != std::string::npos;
        crt::logMessage(crt::LogLevel::Error,
                        (has_places ? "the scene cannot be rendered as it is:\n" : "") + text);
        return error.exitCode();
    } catch (const std::bad_alloc&) {
        crt::logMessage(crt::LogLevel::Error, "out of memory on the host");
        return static_cast<int>(crt::ErrorKind::Device);
    } catch (const std::exception& error) {
        crt::logMessage(crt::LogLevel::Error, fmt::format("internal error: {}", error.what()));
        return static_cast<int>(crt::ErrorKind::Internal);
    }
}
