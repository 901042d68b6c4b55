#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/convert_bench.h"
#include "bench/fit_bench.h"
#include "bench/io_bench.h"
#include "bench/network_bench.h"
#include "bench/render_bench.h"
#include "bench/upscale_bench.h"
#include "cli/table.h"
#include "cli/verb.h"
#include "cli/with_lab/bench_gpu.h"
#include "cli/with_lab/bench_reading.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "network/weights.h"
#include "published/published_checkpoint.h"
#include "request/choice.h"
#include "request/parse.h"
#include "request/upscale_flags.h"

namespace anchorsplat {

namespace {

Status RunIo(const IoBenchOptions& options, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const IoBenchReport report, RunIoBench(options));
  if (shared.json) {
    nlohmann::json rows = nlohmann::json::array();
    for (const IoBenchRow& row : report.Rows()) {
      rows.push_back({{"name", row.name}, {"seconds", row.seconds}, {"bytes", row.bytes}});
      if (row.ratio) rows.back()["ratio"] = {{"value", *row.ratio}, {"meaning", row.ratio_meaning}};
    }
    PrintJson({{"bench", "io"},
               {"gaussians", report.gaussians},
               {"sh_degree", report.sh_degree},
               {"file_bytes", report.file_bytes},
               {"read_ratio", report.read_ratio()},
               {"write_ratio", report.write_ratio()},
               {"memory_ratio", report.memory_ratio()},
               {"rows", rows}});
    return {};
  }
  std::vector<std::vector<std::string>> table = {{"what", "time", "rate", "ratio", "of what"}};
  for (const IoBenchRow& row : report.Rows()) {
    const double rate = row.seconds > 0 ? static_cast<double>(row.bytes) / row.seconds : 0;
    table.push_back({row.name, row.seconds > 0 ? HumanSeconds(row.seconds) : "",
                     rate > 0 ? HumanBytes(static_cast<uint64_t>(rate)) + "/s" : "",
                     row.ratio ? Fixed(*row.ratio, 2) : "", row.ratio_meaning});
  }
  std::cout << WithThousands(report.gaussians) << " Gaussians, SH degree " << report.sh_degree << ", "
            << HumanBytes(report.file_bytes) << "\n\n"
            << FormatTable(table);
  return {};
}

Status RunConvert(const ConvertBenchOptions& options, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ConvertBenchReport report, RunConvertBench(options));
  if (shared.json) {
    nlohmann::json rows = nlohmann::json::array();
    for (const ConvertBenchRow& row : report.rows) {
      rows.push_back({{"target", row.target},
                      {"seconds", row.seconds},
                      {"read_seconds", row.read_seconds},
                      {"write_seconds", row.write_seconds},
                      {"bytes", row.bytes},
                      {"bare_ratio", row.bare_ratio},
                      {"memory_ratio", row.memory_ratio}});
    }
    PrintJson({{"bench", "convert"},
               {"threads", ThreadCount()},
               {"gaussians", report.gaussians},
               {"sh_degree", report.sh_degree},
               {"input_bytes", report.input_bytes},
               {"cat_seconds", report.cat_seconds},
               {"fresh_copy_seconds", report.fresh_copy_seconds},
               {"bare_write_seconds", report.write_seconds},
               {"rows", rows}});
    return {};
  }
  std::vector<std::vector<std::string>> table = {{"to", "time", "read", "write", "size", "bare costs", "memory"}};
  for (const ConvertBenchRow& row : report.rows) {
    table.push_back({row.target, HumanSeconds(row.seconds), HumanSeconds(row.read_seconds),
                     HumanSeconds(row.write_seconds), HumanBytes(row.bytes), Fixed(row.bare_ratio, 2),
                     Fixed(row.memory_ratio, 2)});
  }
  std::cout << WithThousands(report.gaussians) << " Gaussians, SH degree " << report.sh_degree << ", PLY of "
            << HumanBytes(report.input_bytes) << ", " << ThreadCount() << " threads\nread() to nowhere "
            << HumanSeconds(report.cat_seconds) << ", copy into fresh pages " << HumanSeconds(report.fresh_copy_seconds)
            << ", bare write() " << HumanSeconds(report.write_seconds) << "\n\n"
            << FormatTable(table)
            << "\nbare costs: time over read() + copy + write() of as many bytes as came out; memory: peak over the "
               "cloud's arrays\n";
  return {};
}

struct RenderBenchFlags {
  std::string file;
  RenderBenchOptions options;
};

Status RunRenderBench(const RenderBenchFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(flags.file));
  RenderBenchOptions options = flags.options;
  options.seed = shared.seed;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const RenderBenchReport report,
                               BenchRender(cloud, std::filesystem::path(flags.file).stem().string(), options));
  if (shared.json) {
    nlohmann::json rows = nlohmann::json::array();
    for (const RenderBenchRow& row : report.rows) {
      rows.push_back({{"scene", row.scene},
                      {"gaussians", row.gaussians},
                      {"width", row.width},
                      {"ms", row.ms},
                      {"stages_ms",
                       {{"project", row.project_ms},
                        {"spherical_harmonics", row.spherical_harmonics_ms},
                        {"sort", row.sort_ms},
                        {"bin", row.bin_ms},
                        {"blend", row.blend_ms}}},
                      {"visible", row.visible},
                      {"pairs", row.pairs},
                      {"evaluations", row.evaluations},
                      {"blend_of_fma_limit", row.blend_of_fma_limit},
                      {"project_of_memory_limit", row.project_of_memory_limit}});
    }
    PrintJson({{"bench", "render"}, {"threads", ThreadCount()}, {"rows", rows}});
    return {};
  }
  std::vector<std::vector<std::string>> table = {
      {"scene", "Gaussians", "size", "ms", "project", "SH", "sort", "bin", "blend", "blend/FMA", "project/memory"}};
  for (const RenderBenchRow& row : report.rows) {
    table.push_back({row.scene, WithThousands(row.gaussians), Cat(row.width, "²"), Fixed(row.ms, 2),
                     Fixed(row.project_ms, 2), Fixed(row.spherical_harmonics_ms, 2), Fixed(row.sort_ms, 2),
                     Fixed(row.bin_ms, 2), Fixed(row.blend_ms, 2), Fixed(row.blend_of_fma_limit, 2),
                     Fixed(row.project_of_memory_limit, 2)});
  }
  std::cout << "milliseconds per picture, mean over " << options.poses << " poses, fastest of " << options.repeats
            << " repeats, " << ThreadCount() << " threads\n\n"
            << FormatTable(table)
            << "\nblend/FMA: share of this machine's multiply-add rate; project/memory: share of its memory speed\n";
  return {};
}

struct FitBenchFlags {
  std::vector<std::string> files = {"examples/biplane/input.ply", "examples/stone_lantern/input.ply"};
  FitBenchOptions options;
};

Status RunFitBench(const FitBenchFlags& flags, const SharedFlags& shared) {
  FitBenchOptions options = flags.options;
  options.seed = shared.seed;
  std::vector<FitBenchRow> rows;
  for (const std::string& file : flags.files) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(file));
    // The folder's name: all examples are called input.ply.
    const std::filesystem::path path(file);
    const std::string name = path.has_parent_path() ? path.parent_path().filename().string() : path.stem().string();
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<FitBenchRow> some, BenchFit(cloud, name, options));
    rows.insert(rows.end(), some.begin(), some.end());
  }
  if (shared.json) {
    nlohmann::json json = nlohmann::json::array();
    for (const FitBenchRow& row : rows) {
      json.push_back({{"scene", row.scene},
                      {"gaussians", row.gaussians},
                      {"width", row.width},
                      {"ms", row.ms},
                      {"stages_ms",
                       {{"project", row.project_ms},
                        {"spherical_harmonics", row.spherical_harmonics_ms},
                        {"sort", row.sort_ms},
                        {"bin", row.bin_ms},
                        {"blend", row.blend_ms},
                        {"loss", row.loss_ms},
                        {"blend_backward", row.blend_backward_ms},
                        {"project_backward", row.project_backward_ms},
                        {"adam", row.adam_ms},
                        {"densify", row.densify_ms}}},
                      {"visible", row.visible},
                      {"pairs", row.pairs},
                      {"evaluations", row.evaluations}});
    }
    PrintJson({{"bench", "fit"}, {"threads", ThreadCount()}, {"rows", json}});
    return {};
  }
  std::vector<std::vector<std::string>> table = {{"scene", "Gaussians", "size", "ms", "project", "SH", "sort", "bin",
                                                  "blend", "loss", "blend'", "project'", "Adam", "densify"}};
  for (const FitBenchRow& row : rows) {
    table.push_back({row.scene, WithThousands(row.gaussians), Cat(row.width, "²"), Fixed(row.ms, 2),
                     Fixed(row.project_ms, 2), Fixed(row.spherical_harmonics_ms, 2), Fixed(row.sort_ms, 2),
                     Fixed(row.bin_ms, 2), Fixed(row.blend_ms, 2), Fixed(row.loss_ms, 2),
                     Fixed(row.blend_backward_ms, 2), Fixed(row.project_backward_ms, 2), Fixed(row.adam_ms, 2),
                     Fixed(row.densify_ms, 2)});
  }
  std::cout << "milliseconds per iteration of a fit, mean over " << options.poses << " poses, fastest of "
            << options.repeats << " repeats, " << ThreadCount() << " threads; ' is the backward pass\n\n"
            << FormatTable(table);
  return {};
}

struct NetworkBenchFlags {
  std::string file = "examples/biplane/input.ply";
  std::string model;
  WeightPrecision precision = WeightPrecision::kFloat;
  NetworkBenchOptions options;
};

Status RunNetworkBench(const NetworkBenchFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(flags.file));
  const PublishedConfig published;
  auto loaded = flags.model.empty() ? PublishedNetwork::Load(published, HashWeights(), flags.precision)
                                    : LoadPublishedNetwork(flags.model, flags.precision);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PublishedNetwork network, std::move(loaded));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const NetworkBenchReport report, BenchNetwork(cloud, network, flags.options));
  if (shared.json) {
    nlohmann::json steps = nlohmann::json::array();
    for (const NetworkBenchStep& step : report.steps) {
      steps.push_back({{"name", step.name}, {"seconds", step.seconds}, {"multiply_adds", step.multiply_adds}});
    }
    PrintJson({{"bench", "network"},
               {"threads", report.threads},
               {"bfloat16_products", report.bfloat16_products},
               {"gaussians", report.gaussians},
               {"copies", report.copies},
               {"seconds", report.seconds},
               {"multiply_adds", report.multiply_adds},
               {"gemm_flops", report.gemm_flops},
               {"ratio", report.ratio},
               {"enhance_seconds", report.enhance_seconds},
               {"steps", steps}});
    return {};
  }
  std::vector<std::vector<std::string>> table = {{"step", "time", "G multiply-adds", "of GEMM rate"}};
  for (const NetworkBenchStep& step : report.steps) {
    const bool counted = step.multiply_adds > 0 && step.seconds > 0;
    table.push_back({step.name, HumanSeconds(step.seconds), counted ? Fixed(step.multiply_adds / 1e9, 1) : "",
                     counted ? Fixed(2 * step.multiply_adds / step.seconds / report.gemm_flops, 2) : ""});
  }
  std::cout << WithThousands(report.gaussians) << " Gaussians, K = " << report.copies << ", " << report.threads
            << " threads; plain matrix product: " << Fixed(report.gemm_flops / 1e9, 0) << " GFLOP/s\n\n"
            << FormatTable(table) << "\nforward pass " << HumanSeconds(report.seconds) << ", "
            << Fixed(report.multiply_adds / 1e9, 1) << " G multiply-adds; ratio to the matrix product's rate "
            << Fixed(report.ratio, 2) << "\nwhole enhancement " << HumanSeconds(report.enhance_seconds) << "\n"
            << (report.bfloat16_products ? "this processor has bfloat16 products: bf16 is faster than fp32\n"
                                         : "this processor has no bfloat16 products: bf16 is slower than fp32, and "
                                           "`enhance` takes fp32 instead\n");
  return {};
}

struct UpscaleBenchFlags {
  std::string network;
  std::string size = "200x150";
  UpscaleBenchOptions options;
};

Status RunUpscaleBench(const UpscaleBenchFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Upscaler network, Upscaler::Read(flags.network));
  UpscaleBenchOptions options = flags.options;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SizeOption size, ParseSize("--size", flags.size));
  options.width = size.width;
  options.height = size.height;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const UpscaleBenchReport report, BenchUpscale(network, options));
  if (shared.json) {
    PrintJson({{"bench", "upscale"},
               {"threads", report.threads},
               {"width", options.width},
               {"height", options.height},
               {"network", ToJson(network.info())},
               {"seconds", report.seconds},
               {"multiply_adds", report.multiply_adds},
               {"gemm_flops", report.gemm_flops},
               {"ratio", report.ratio}});
    return {};
  }
  std::cout << network.info().architecture << ", a picture of " << options.width << "x" << options.height
            << " enlarged " << network.info().scale << " times, " << report.threads
            << " threads; plain matrix product: " << Fixed(report.gemm_flops / 1e9, 0) << " GFLOP/s\n\n"
            << HumanSeconds(report.seconds) << ", " << Fixed(report.multiply_adds / 1e9, 1)
            << " G multiply-adds; ratio to the matrix product's rate " << Fixed(report.ratio, 2) << "\n";
  return {};
}

void AddRenderBench(CLI::App& parent, Program& program) {
  CLI::App& render =
      AddVerb(parent, program, "render", "The rasterizer at 256², at 1024², and with every Gaussian split",
              "anchorsplat bench render examples/biplane/input.ply");
  const auto render_flags = std::make_shared<RenderBenchFlags>();
  render_flags->file = "examples/biplane/input.ply";
  render.add_option("file", render_flags->file, "Splat file, an object near the origin about one unit in size")
      ->capture_default_str();
  render.add_option("--poses", render_flags->options.poses, "On the orbit")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  render.add_option("--radius", render_flags->options.radius, "Of the orbit, world units")
      ->check(Positive())
      ->capture_default_str();
  render.add_option("--repeats", render_flags->options.repeats, "The fastest counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  render.add_option("--split", render_flags->options.split, "Gaussians made of each in the last load")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  render.callback([render_flags, &program] {
    program.run = [render_flags, &program] { return RunRenderBench(*render_flags, program.flags); };
  });
}

void AddFitBench(CLI::App& parent, Program& program) {
  CLI::App& fit = AddVerb(parent, program, "fit", "One iteration of a fit at 256² and at 1024², stage by stage",
                          "anchorsplat bench fit --threads 1");
  const auto fit_flags = std::make_shared<FitBenchFlags>();
  fit.add_option("files", fit_flags->files, "Splat files, objects near the origin about one unit in size")
      ->capture_default_str();
  fit.add_option("--poses", fit_flags->options.poses, "On the orbit")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  fit.add_option("--radius", fit_flags->options.radius, "Of the orbit, world units")
      ->check(Positive())
      ->capture_default_str();
  fit.add_option("--width", fit_flags->options.widths, "Pixels per side, one or more")
      ->check(CLI::Range(11, 8192))
      ->capture_default_str();
  fit.add_option("--repeats", fit_flags->options.repeats, "The fastest counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  fit.add_option("--split", fit_flags->options.split, "Dense splats: smaller and fainter Gaussians made of each")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  fit.callback([fit_flags, &program] {
    program.run = [fit_flags, &program] { return RunFitBench(*fit_flags, program.flags); };
  });
}

void AddNetworkBench(CLI::App& parent, Program& program) {
  CLI::App& network = AddVerb(parent, program, "network", "The AnchorSplat network against a plain matrix product",
                              "anchorsplat bench network scan.ply --model anchorsplat_20x.pth");
  const auto network_flags = std::make_shared<NetworkBenchFlags>();
  network.add_option("file", network_flags->file, "Splat file")->capture_default_str();
  network.add_option("--model", network_flags->model,
                     "Checkpoint (default: made-up weights of the published size, K = 20)");
  AddChoice(network, "--precision", network_flags->precision,
            {{"fp32", WeightPrecision::kFloat}, {"bf16", WeightPrecision::kBFloat16}},
            "Of matrix products, convolutions and attention");
  AddChoice(network, "--attention-rounding", network_flags->options.rounding,
            {{"none", Rounding::kNone}, {"fp16", Rounding::kHalf}, {"bf16", Rounding::kBFloat16}},
            "Of the attention's arithmetic");
  network.add_option("--repeats", network_flags->options.repeats, "The fastest counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  network.callback([network_flags, &program] {
    program.run = [network_flags, &program] { return RunNetworkBench(*network_flags, program.flags); };
  });
}

void AddUpscaleBench(CLI::App& parent, Program& program) {
  CLI::App& upscale =
      AddVerb(parent, program, "upscale", "A network that enlarges pictures against a plain matrix product",
              "anchorsplat bench upscale --network span.safetensors");
  const auto flags = std::make_shared<UpscaleBenchFlags>();
  upscale.add_option("--network", flags->network, "A network's .safetensors")->required()->check(NotEmpty());
  upscale.add_option("--size", flags->size, "Of the picture that is enlarged")->capture_default_str();
  upscale.add_option("--repeats", flags->options.repeats, "The fastest counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  upscale.callback(
      [flags, &program] { program.run = [flags, &program] { return RunUpscaleBench(*flags, program.flags); }; });
}

void AddConvertBench(CLI::App& parent, Program& program) {
  CLI::App& convert =
      AddVerb(parent, program, "convert", "From PLY to every format against bare reads, writes and copies",
              "anchorsplat bench convert examples/biplane/input.ply --to .sog");
  const auto convert_options = std::make_shared<ConvertBenchOptions>();
  convert.add_option("file", convert_options->file, "A PLY (default: made-up values)");
  convert.add_option("--gaussians", convert_options->gaussians, "How many are made up")
      ->check(CLI::Range(int64_t{1000}, int64_t{100'000'000}))
      ->capture_default_str();
  convert.add_option("--sh-degree", convert_options->sh_degree, "Of those made up")
      ->check(CLI::Range(0, 3))
      ->capture_default_str();
  convert.add_option("--to", convert_options->targets, "Ends of file names; .3.spz is SPZ version 3")
      ->capture_default_str();
  convert.add_option("--repeats", convert_options->repeats, "The fastest counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  convert.add_option("--folder", convert_options->folder,
                     "Where to make the files (default: the system's temporary folder)");
  convert.callback([convert_options, &program] {
    program.run = [convert_options, &program] { return RunConvert(*convert_options, program.flags); };
  });
}

void AddIoBench(CLI::App& parent, Program& program) {
  CLI::App& io = AddVerb(parent, program, "io", "Reading and writing PLY against bare reads, writes and copies",
                         "anchorsplat bench io --gaussians 500000");
  const auto options = std::make_shared<IoBenchOptions>();
  io.add_option("--gaussians", options->gaussians, "How many")
      ->check(CLI::Range(int64_t{1000}, int64_t{100'000'000}))
      ->capture_default_str();
  io.add_option("--sh-degree", options->sh_degree, "Of the spherical harmonics")
      ->check(CLI::Range(0, 3))
      ->capture_default_str();
  io.add_option("--repeats", options->repeats, "The fastest counts")->check(CLI::Range(1, 1000))->capture_default_str();
  io.add_option("--folder", options->folder, "Where to make the file (default: the system's temporary folder)");
  io.callback([options, &program] { program.run = [options, &program] { return RunIo(*options, program.flags); }; });
}

}  // namespace

void AddBench(CLI::App& app, Program& program) {
  CLI::App& verb = *app.add_subcommand("bench", "Measure this machine, as ratios to its own limits");
  verb.require_subcommand(1);
  verb.footer("Example:\n  anchorsplat bench render");
  AddRenderBench(verb, program);
  AddFitBench(verb, program);
  AddNetworkBench(verb, program);
  AddUpscaleBench(verb, program);
  AddConvertBench(verb, program);
  AddIoBench(verb, program);
  AddGpuBench(verb, program);
  AddReadingBench(verb, program);
}

}  // namespace anchorsplat
