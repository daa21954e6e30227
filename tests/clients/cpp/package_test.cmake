# Installs what a programmer of other software needs and builds the example outside the tree against it.
# Variables: build (of tubed), source, folder (scratch), compiler_c, compiler_cxx, sanitize.
if(sanitize)
  set(flags -fsanitize=${sanitize})
endif()
file(REMOVE_RECURSE ${folder})
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE code)
  if(code)
    message(FATAL_ERROR "failed (${code}): ${ARGV}")
  endif()
endfunction()
run(${CMAKE_COMMAND} --build ${build} --target tubed_client tubed_shm tubed_shm_c)
run(${CMAKE_COMMAND} --install ${build} --component client --prefix ${folder}/prefix)
file(COPY ${source}/clients/cpp/example DESTINATION ${folder})
run(${CMAKE_COMMAND} -G Ninja -S ${folder}/example -B ${folder}/build -DCMAKE_PREFIX_PATH=${folder}/prefix
    -DCMAKE_C_COMPILER=${compiler_c} -DCMAKE_CXX_COMPILER=${compiler_cxx} "-DCMAKE_CXX_FLAGS=${flags}" "-DCMAKE_C_FLAGS=${flags}")
run(${CMAKE_COMMAND} --build ${folder}/build)

# The shared memory alone: C programs, no DDS, no C++ compiler.
run(${CMAKE_COMMAND} --install ${build} --component shm --prefix ${folder}/shm_prefix)
run(${CMAKE_COMMAND} -G Ninja -S ${folder}/example/shm -B ${folder}/shm_build -DCMAKE_PREFIX_PATH=${folder}/shm_prefix
    -DCMAKE_C_COMPILER=${compiler_c} "-DCMAKE_C_FLAGS=${flags} -Wall -Wextra -Wpedantic -Wconversion -Werror")
run(${CMAKE_COMMAND} --build ${folder}/shm_build)
run(${folder}/shm_build/grabber ${folder}/a.sock A 5)
if(EXISTS ${folder}/a.sock)
  message(FATAL_ERROR "the grabber left its socket behind")
endif()
execute_process(COMMAND ${folder}/shm_build/watch ${folder}/nobody.sock 1 OUTPUT_VARIABLE said RESULT_VARIABLE code)
if(code OR NOT said MATCHES "NO SHAPE: event 0 nobody writes at")
  message(FATAL_ERROR "watch (${code}) said: ${said}")
endif()
