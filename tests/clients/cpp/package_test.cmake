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
run(${CMAKE_COMMAND} --build ${build} --target tubed_client)
run(${CMAKE_COMMAND} --install ${build} --component client --prefix ${folder}/prefix)
file(COPY ${source}/clients/cpp/example DESTINATION ${folder})
run(${CMAKE_COMMAND} -G Ninja -S ${folder}/example -B ${folder}/build -DCMAKE_PREFIX_PATH=${folder}/prefix
    -DCMAKE_C_COMPILER=${compiler_c} -DCMAKE_CXX_COMPILER=${compiler_cxx} "-DCMAKE_CXX_FLAGS=${flags}" "-DCMAKE_C_FLAGS=${flags}")
run(${CMAKE_COMMAND} --build ${folder}/build)
