#include "drivers/laboratory/aurora_emulator/port_handles.hpp"

#include <algorithm>
#include <iterator>

namespace tubed::aurora::emulator {

namespace {

constexpr std::uint8_t kFirstHandle = 0x0A;
constexpr std::uint16_t kBecameOccupied = 0x40;
constexpr std::uint16_t kBecameUnoccupied = 0x80;

bool listed(const PortHandle& handle, HandleQuery query) {
  switch (query) {
    case HandleQuery::kAll:
      return true;
    case HandleQuery::kToBeFreed:
      return handle.stale;
    case HandleQuery::kToBeInitialised:
      return !handle.stale && !handle.initialised;
    case HandleQuery::kToBeEnabled:
      return !handle.stale && handle.initialised && !handle.enabled;
    case HandleQuery::kEnabled:
      return handle.enabled;
  }
  return false;
}

}  // namespace

PortStatus PortHandle::status() const noexcept {
  constexpr std::uint32_t kOfInitialised = 0x0002000E;
  const auto bit = [](bool set, unsigned place) { return set ? 1U << place : 0U; };
  return {(initialised ? kOfInitialised : 0U) | bit(!stale, 0) | bit(initialised, 4) | bit(enabled, 5)};
}

Report PortHandle::report_without_data() const noexcept {
  return stale && empty_when_tracking_began ? Report::kUnoccupied : Report::kDisabled;
}

bool ToolImage::complete() const noexcept {
  constexpr std::uint32_t kAllBlocks = (1U << kSize / kToolMemoryBlock) - 1;
  return blocks == kAllBlocks &&
         std::any_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte != 0; });
}

PortHandles::PortHandles(const std::vector<Plug>& plugs) {
  for (const Plug& plug : plugs) {
    tools_.push_back({plug, true, {}});
  }
  give_handles();
}

void PortHandles::start_anew() {
  handles_.clear();
  news = {};
  give_handles();
}

void PortHandles::forget_descriptions() {
  for (Tool& tool : tools_) {
    tool.image = {};
  }
}

bool PortHandles::plug_in(int port) { return plug_in_tool(tool_of(port)); }

bool PortHandles::plug_in_stranger(int port, std::uint32_t serial_number, std::string_view part_number) {
  if (tool_in(port) != tools_.size()) {
    return false;
  }
  Plug stranger;
  const std::size_t own = tool_of(port);
  stranger.sensors = own == tools_.size() ? std::vector<int>{0} : tools_[own].plug.sensors;
  stranger.port = port;
  stranger.serial_number = serial_number;
  stranger.part_number = part_number;
  tools_.push_back({stranger, false, {}});
  return plug_in_tool(tools_.size() - 1);
}

bool PortHandles::plug_in_tool(std::size_t tool) {
  if (tool == tools_.size() || tool_in(tools_[tool].plug.port) != tools_.size()) {
    return false;
  }
  tools_[tool].plugged_in = true;
  news.bits |= kBecameOccupied;
  give_handles();
  return true;
}

bool PortHandles::pull_out(int port) {
  const std::size_t tool = tool_in(port);
  if (tool == tools_.size()) {
    return false;
  }
  tools_[tool].plugged_in = false;
  tools_[tool].image = {};
  news.bits |= kBecameUnoccupied;
  for (PortHandle& handle : handles_) {
    handle.stale |= handle.plug == tool;
  }
  return true;
}

void PortHandles::begin_tracking() {
  for (PortHandle& handle : handles_) {
    handle.empty_when_tracking_began = handle.stale;
  }
}

std::vector<PortHandle> PortHandles::list(HandleQuery query) {
  news = {};
  give_handles();
  std::vector<PortHandle> found;
  std::copy_if(handles_.begin(), handles_.end(), std::back_inserter(found),
               [query](const PortHandle& handle) { return listed(handle, query); });
  return found;
}

PortHandle* PortHandles::find(std::uint8_t number) noexcept {
  const auto found = std::find_if(handles_.begin(), handles_.end(),
                                  [number](const PortHandle& handle) { return handle.number == number; });
  return found == handles_.end() ? nullptr : &*found;
}

Error PortHandles::check(const PortHandle* handle) const noexcept {
  if (handle == nullptr) {
    return Error::kHandle;
  }
  return handle->stale ? Error::kNoTool : Error::kNone;
}

Error PortHandles::initialise(std::uint8_t number) {
  const PortHandle* handle = find(number);
  if (const Error error = check(handle); error != Error::kNone) {
    return error;
  }
  const std::size_t plug = handle->plug;
  const Tool& tool = tools_[plug];
  if (tool.plug.memory == ToolMemory::kBlank && !tool.image.complete()) {
    return Error::kCannotInitialise;
  }
  if (tool.plug.sensors.size() > 1 && !has_handle(plug, 1)) {
    add_handle(plug, 1);
  }
  for (PortHandle& other : handles_) {
    other.initialised |= other.plug == plug && !other.stale;
  }
  return Error::kNone;
}

Error PortHandles::enable(std::uint8_t number) {
  PortHandle* handle = find(number);
  if (const Error error = check(handle); error != Error::kNone) {
    return error;
  }
  if (!handle->initialised) {
    return Error::kNotInitialised;
  }
  handle->enabled = true;
  return Error::kNone;
}

Error PortHandles::disable(std::uint8_t number) {
  PortHandle* handle = find(number);
  if (handle == nullptr) {
    return Error::kHandle;
  }
  if (!handle->enabled) {
    return Error::kNotEnabled;
  }
  handle->enabled = false;
  return Error::kNone;
}

Error PortHandles::free(std::uint8_t number) {
  const PortHandle* handle = find(number);
  if (handle == nullptr) {
    return Error::kHandle;
  }
  handles_.erase(handles_.begin() + (handle - handles_.data()));
  return Error::kNone;
}

Error PortHandles::write(std::uint8_t number, std::uint32_t address, Bytes block) {
  const PortHandle* handle = find(number);
  if (const Error error = check(handle); error != Error::kNone) {
    return error;
  }
  ToolImage& image = tools_[handle->plug].image;
  if (address % kToolMemoryBlock != 0 || address + block.size() > image.bytes.size()) {
    return Error::kOutOfRange;
  }
  std::copy(block.begin(), block.end(), image.bytes.begin() + address);
  image.blocks |= 1U << address / kToolMemoryBlock;
  return Error::kNone;
}

const ToolImage* PortHandles::written(int port) const {
  const std::size_t tool = tool_in(port);
  return tool == tools_.size() ? nullptr : &tools_[tool].image;
}

Error PortHandles::request(const PortRequest& request, std::uint8_t& number) {
  Error error = Error::kPortDescription;
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    const Tool& tool = tools_[i];
    const int channel = request.channel.value_or(0);
    if (!tool.plugged_in || request.port.value_or(tool.plug.port) != tool.plug.port || channel != 0) {
      continue;  // channel 1 gets its handle by PINIT
    }
    if (has_handle(i, channel)) {
      error = Error::kPortAssigned;
      continue;
    }
    const PortHandle* handle = add_handle(i, channel);
    number = handle == nullptr ? number : handle->number;
    return handle == nullptr ? Error::kNoHandleLeft : Error::kNone;
  }
  return error;
}

void PortHandles::give_handles() {
  for (std::size_t tool = 0; tool < tools_.size(); ++tool) {
    if (tools_[tool].plugged_in && !has_handle(tool, 0)) {
      add_handle(tool, 0);
    }
  }
}

PortHandle* PortHandles::add_handle(std::size_t plug, int channel) {
  if (handles_.size() >= static_cast<std::size_t>(kMaxHandles)) {
    return nullptr;
  }
  std::uint8_t number = kFirstHandle;
  while (find(number) != nullptr) {
    ++number;
  }
  PortHandle handle;
  handle.number = number;
  handle.plug = plug;
  handle.channel = channel;
  handles_.push_back(handle);
  return &handles_.back();
}

bool PortHandles::has_handle(std::size_t plug, int channel) const {
  return std::any_of(handles_.begin(), handles_.end(), [&](const PortHandle& handle) {
    return handle.plug == plug && handle.channel == channel && !handle.stale;
  });
}

std::size_t PortHandles::tool_of(int port) const {
  const auto found =
      std::find_if(tools_.begin(), tools_.end(), [port](const Tool& tool) { return tool.plug.port == port; });
  return static_cast<std::size_t>(found - tools_.begin());
}

std::size_t PortHandles::tool_in(int port) const {
  const auto found = std::find_if(tools_.begin(), tools_.end(), [port](const Tool& tool) {
    return tool.plugged_in && tool.plug.port == port;
  });
  return static_cast<std::size_t>(found - tools_.begin());
}

}  // namespace tubed::aurora::emulator
