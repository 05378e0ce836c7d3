# catoptric_embed_shaders(TARGET files...) embeds shader files (paths from the calling folder) in
# the static library TARGET, e.g. catoptric_raster. Their names in gl/shader.h are their paths from
# src/. The generated source registers itself; the undefined symbol makes the linker keep it.
function(catoptric_embed_shaders target)
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/${target}_shaders.cpp)
  set(inputs)
  foreach(file ${ARGN})
    list(APPEND inputs ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  endforeach()
  set(script ${PROJECT_SOURCE_DIR}/cmake/EmbedShaders.cmake)
  list(JOIN inputs "|" joined)
  add_custom_command(OUTPUT ${generated}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${generated} -DTARGET=${target}
            -DROOT=${PROJECT_SOURCE_DIR}/src "-DFILES=${joined}" -P ${script}
    DEPENDS ${inputs} ${script}
    COMMENT "Embedding shaders of ${target}"
    VERBATIM)
  set_source_files_properties(${generated} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  target_sources(${target} PRIVATE ${generated})
  target_link_options(${target} INTERFACE "LINKER:--undefined=${target}_shaders")
endfunction()
