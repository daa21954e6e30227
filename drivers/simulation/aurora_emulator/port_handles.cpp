#include "drivers/simulation/aurora_emulator/port_handles.hpp"

#include <algorithm>

#include "drivers/aurora/tracking_reply.hpp"

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
  constexpr std::uint32_t kAlwaysSet = 0x0002000E;
  const auto bit = [](bool set, unsigned place) { return set ? 1U << place : 0U; };
  return {kAlwaysSet | bit(!stale, 0) | bit(initialised, 4) | bit(enabled, 5)};
}

PortHandles::PortHandles(const std::vector<Plug>& plugs) {
  for (const Plug& plug : plugs) {
    tools_.push_back({plug});
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
    tool.written_blocks = 0;
  }
}

bool PortHandles::plug_in(int port) {
  const std::size_t tool = find_tool(port);
  if (tool == tools_.size() || tools_[tool].plugged_in) {
    return false;
  }
  tools_[tool].plugged_in = true;
  news.bits |= kBecameOccupied;
  give_handles();
  return true;
}

bool PortHandles::pull_out(int port) {
  const std::size_t tool = find_tool(port);
  if (tool == tools_.size() || !tools_[tool].plugged_in) {
    return false;
  }
  tools_[tool].plugged_in = false;
  tools_[tool].written_blocks = 0;
  news.bits |= kBecameUnoccupied;
  for (PortHandle& handle : handles_) {
    handle.stale |= handle.plug == tool;
  }
  return true;
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
  if (tool.plug.memory == ToolMemory::kBlank && tool.written_blocks != kAllBlocks) {
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

Error PortHandles::write(std::uint8_t number, std::uint32_t address) {
  const PortHandle* handle = find(number);
  if (const Error error = check(handle); error != Error::kNone) {
    return error;
  }
  const std::uint32_t block = address / static_cast<std::uint32_t>(kToolMemoryBlock);
  if (address % kToolMemoryBlock != 0 || block >= 16) {
    return Error::kOutOfRange;
  }
  tools_[handle->plug].written_blocks |= 1U << block;
  return Error::kNone;
}

void PortHandles::give_handles() {
  for (std::size_t tool = 0; tool < tools_.size(); ++tool) {
    if (tools_[tool].plugged_in && !has_handle(tool, 0)) {
      add_handle(tool, 0);
    }
  }
}

void PortHandles::add_handle(std::size_t plug, int channel) {
  if (handles_.size() >= static_cast<std::size_t>(kMaxHandles)) {
    return;  // no more to give until stale ones are freed
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
}

bool PortHandles::has_handle(std::size_t plug, int channel) const {
  return std::any_of(handles_.begin(), handles_.end(), [&](const PortHandle& handle) {
    return handle.plug == plug && handle.channel == channel && !handle.stale;
  });
}

std::size_t PortHandles::find_tool(int port) const {
  const auto found =
      std::find_if(tools_.begin(), tools_.end(), [port](const Tool& tool) { return tool.plug.port == port; });
  return static_cast<std::size_t>(found - tools_.begin());
}

}  // namespace tubed::aurora::emulator
