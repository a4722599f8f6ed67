// A command line for Microsoft's compiler, of which PyPI carries only the library.
// Usage: dxc LIBRARY FILE OUTPUT INCLUDE_FOLDER FLAG... ; FLAGs are dxc's own, without -I.
#include "WinAdapter.h"
#include "dxcapi.h"
#include <dlfcn.h>
#include <cstdio>
#include <string>
#include <vector>

static std::wstring wide(const char* text) { return std::wstring(text, text + std::string(text).size()); }

int main(int argc, char** argv) {
    if (argc < 5) return fprintf(stderr, "usage: dxc LIBRARY FILE OUTPUT INCLUDE_FOLDER FLAG...\n"), 2;
    void* library = dlopen(argv[1], RTLD_NOW);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 2;
    auto create = reinterpret_cast<DxcCreateInstanceProc>(dlsym(library, "DxcCreateInstance"));
    CComPtr<IDxcCompiler3> compiler;
    CComPtr<IDxcUtils> utils;
    CComPtr<IDxcIncludeHandler> includes;
    CComPtr<IDxcBlobEncoding> source;
    if (FAILED(create(CLSID_DxcCompiler, IID_PPV_ARGS(&compiler))) ||
        FAILED(create(CLSID_DxcUtils, IID_PPV_ARGS(&utils))) ||
        FAILED(utils->CreateDefaultIncludeHandler(&includes)) ||
        FAILED(utils->LoadFile(wide(argv[2]).c_str(), nullptr, &source)))
        return fprintf(stderr, "dxc: no compiler, or no file %s\n", argv[2]), 2;

    std::vector<std::wstring> flags{wide(argv[2]), L"-I", wide(argv[4])};
    for (int i = 5; i < argc; i++) flags.push_back(wide(argv[i]));
    std::vector<LPCWSTR> pointers;
    for (auto& flag : flags) pointers.push_back(flag.c_str());
    DxcBuffer buffer{source->GetBufferPointer(), source->GetBufferSize(), DXC_CP_UTF8};
    CComPtr<IDxcResult> result;
    if (FAILED(compiler->Compile(&buffer, pointers.data(), pointers.size(), includes, IID_PPV_ARGS(&result)))) return 2;

    CComPtr<IDxcBlobUtf8> messages;
    result->GetOutput(DXC_OUT_ERRORS, IID_PPV_ARGS(&messages), nullptr);
    if (messages && messages->GetStringLength()) fprintf(stderr, "%s", messages->GetStringPointer());
    HRESULT status = E_FAIL;
    result->GetStatus(&status);
    CComPtr<IDxcBlob> object;
    if (FAILED(status) || FAILED(result->GetOutput(DXC_OUT_OBJECT, IID_PPV_ARGS(&object), nullptr))) return 1;
    FILE* output = fopen(argv[3], "wb");
    bool written = output && fwrite(object->GetBufferPointer(), object->GetBufferSize(), 1, output) == 1;
    return written && fclose(output) == 0 ? 0 : 2;
}
