#include "train/process_group.h"

#include <charconv>
#include <cstdlib>
#include <string>
#include <torch/csrc/distributed/c10d/ProcessGroupGloo.hpp>
#include <torch/csrc/distributed/c10d/TCPStore.hpp>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

namespace {

class GlooGroup : public ProcessGroup {
 public:
  GlooGroup(c10::intrusive_ptr<c10d::ProcessGroupGloo> gloo, int rank, int size)
      : gloo_(std::move(gloo)), rank_(rank), size_(size) {}

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void Sum(torch::Tensor& tensor) override { Reduce(tensor, c10d::ReduceOp::SUM); }
  void Max(torch::Tensor& tensor) override { Reduce(tensor, c10d::ReduceOp::MAX); }

 private:
  void Reduce(torch::Tensor& tensor, c10d::ReduceOp::RedOpType operation) {
    const torch::NoGradGuard no_gradient;
    std::vector<torch::Tensor> own = {tensor.detach().to(torch::kCPU).contiguous()};
    c10d::AllreduceOptions options;
    options.reduceOp = operation;
    gloo_->allreduce(own, options)->wait();
    if (!own[0].is_same(tensor)) tensor.detach().copy_(own[0]);
  }

  c10::intrusive_ptr<c10d::ProcessGroupGloo> gloo_;
  int rank_, size_;
};

Result<int> Number(const char* name, int low, int high) {
  const char* text = std::getenv(name);
  const std::string value = text == nullptr ? "" : text;
  int number = 0;
  const auto [end, code] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (code != std::errc() || end != value.data() + value.size() || number < low || number > high) {
    return Error{ErrorCode::kBadArgument,
                 Cat("environment: ", name, " is \"", Printable(value), "\", expected a number from ", low, " to ",
                     high, " (set WORLD_SIZE, RANK, MASTER_ADDR and MASTER_PORT together)")};
  }
  return number;
}

bool IsLoopback(const std::string& address) {
  return address == "localhost" || address == "::1" || address.starts_with("127.");
}

}  // namespace

Result<std::unique_ptr<ProcessGroup>> ProcessGroup::FromEnvironment() {
  if (std::getenv("WORLD_SIZE") == nullptr) return std::unique_ptr<ProcessGroup>();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int size, Number("WORLD_SIZE", 1, 1 << 16));
  if (size == 1) return std::unique_ptr<ProcessGroup>();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int rank, Number("RANK", 0, size - 1));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int port, Number("MASTER_PORT", 1, 65535));
  const char* address = std::getenv("MASTER_ADDR");
  if (address == nullptr) return Error{ErrorCode::kBadArgument, "environment: MASTER_ADDR is missing"};
  try {
    c10d::TCPStoreOptions store_options;
    store_options.port = static_cast<uint16_t>(port);
    store_options.isServer = rank == 0;
    store_options.numWorkers = static_cast<std::size_t>(size);
    const auto store = c10::make_intrusive<c10d::TCPStore>(address, store_options);
    const auto options = c10d::ProcessGroupGloo::Options::create();
    options->devices.push_back(IsLoopback(address) ? c10d::ProcessGroupGloo::createDeviceForHostname(address)
                                                   : c10d::ProcessGroupGloo::createDefaultDevice());
    auto gloo = c10::make_intrusive<c10d::ProcessGroupGloo>(store, rank, size, options);
    return std::unique_ptr<ProcessGroup>(std::make_unique<GlooGroup>(std::move(gloo), rank, size));
  } catch (const std::exception& failure) {
    return Error{ErrorCode::kIo,
                 Cat("the ", size, " processes at ", address, ":", port, " could not connect: ", failure.what())};
  }
}

}  // namespace anchorsplat
