"""numba in a process that does nothing but compile: the same arithmetic for less than two thirds of the work.

A caller gets its pieces here before they have been optimised, and made into machine code, by themselves; so its
instructions may stand in another order. A million steps of the attack (docs/safety.md) were the same to the last bit.

A planner's and a user's process have numba as it is and do not import this module. What is replaced here belongs to
numba's inside, so it is done for versions that have been tried; with any other one the process compiles as numba has
it, and takes longer.
"""

from __future__ import annotations

from typing import Any, cast

import numba
from numba.core import analysis, postproc, transforms
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_lock import global_compiler_lock
from numba.core.cpu import CPUContext
from numba.core.dispatcher import Dispatcher
from numba.core.targetconfig import ConfigStack, TargetConfig
from numba.core.types.functions import BaseFunction

TRIED = frozenset({"0.68.1"})


def compile_only() -> bool:
    """Let numba do only what is needed here, from now on to the end of this process; whether it could be done."""
    if numba.__version__ not in TRIED:
        return False
    _compare_options_quickly()
    _remember_types_of_calls()
    _find_live_variables_when_asked()
    _leave_out_what_no_caller_needs()
    return True


def _compare_options_quickly() -> None:
    """numba makes two dictionaries of all options for each comparison, a hundred thousand times.

    Here only those are compared that one of both has been given. Its hash is of the names of all, the same for every
    one; here it is of the names of those that differ from their default.
    """
    options = cast(Any, TargetConfig)
    compare = options.__eq__

    def equal(one: Any, other: Any) -> Any:
        if type(one) is not type(other):
            return compare(one, other)
        mine, its = one._values, other._values
        usual = {name: one.options[name].default for name in mine.keys() | its.keys()}
        return all(mine.get(name, default) == its.get(name, default) for name, default in usual.items())

    def names(one: Any) -> int:
        return hash(frozenset(name for name, value in one._values.items() if value != one.options[name].default))

    options.__eq__, options.__hash__ = equal, names


def _remember_types_of_calls() -> None:
    """What an operator or a function of numba's gives for some types is found once.

    numba goes through all of its definitions, ten for a plus, wherever one stands.
    """
    function = cast(Any, BaseFunction)
    find, found = function.get_call_type, dict[Any, Any]()

    def get_call_type(self: Any, context: Any, args: Any, keywords: Any) -> Any:
        given = self, context, tuple(args), tuple(keywords.items()), ConfigStack.top_or_none()  # type: ignore[no-untyped-call]
        if given not in found:
            signature = find(self, context, args, keywords)
            found[given] = signature, self._impl_keys[signature.args]
        signature, key = found[given]
        self._impl_keys[signature.args] = key  # of another instance of the same function perhaps
        return signature

    function.get_call_type = get_call_type


def _find_live_variables_when_asked() -> None:
    """numba finds the variables that are alive where each block begins after each of its passes; nobody asks here."""
    processor = cast(Any, postproc.PostProcessor)
    run = processor.run

    def run_less(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        code = self.func_ir
        if emit_dels or code.is_generator:
            run(self, emit_dels, extend_lifetimes)
            return
        code.blocks = cast(Any, transforms.canonicalize_cfg)(code.blocks)
        code.variable_lifetime = cast(Any, postproc.VariableLifetime)(code.blocks)
        code.block_entry_vars = _LiveVariables(code)
        code.generator_info = None

    processor.run = run_less


class _LiveVariables(dict[Any, Any]):
    """Names of the variables that are alive at the entry of each block."""

    def __init__(self, code: Any) -> None:
        super().__init__()
        self._code = code

    def __missing__(self, block: Any) -> Any:
        blocks, life = self._code.blocks, self._code.variable_lifetime
        alive = cast(Any, analysis.compute_live_variables)(
            life.cfg, blocks, life.usedefs.defmap, life.deadmaps.combined
        )
        self.update({one: alive[offset] for offset, one in blocks.items()})
        if block not in self:
            raise KeyError(block)
        return self[block]


def _leave_out_what_no_caller_needs() -> None:
    """What is compiled for a caller is put into that caller and optimised as a part of it; nobody else runs it here.

    So it is not optimised by itself beyond each function's own passes, it gets no machine code and no entry for Python,
    and it is not kept. Where Python calls it after all, it is compiled once more with all of that.
    A piece that prints, or raises an error with a message of its own making, does so only where it is loaded: it has
    no environment in this process. Pieces that call each other in a circle cannot be compiled here.
    """
    _mark_inner_libraries()
    _leave_out_code()
    _leave_out_entries()
    cache = cast(Any, FunctionCache)
    save = cache.save_overload

    def save_outer(self: Any, signature: Any, result: Any) -> None:
        if not result.library.is_inner:
            save(self, signature, result)

    cache.save_overload = save_outer


def _mark_inner_libraries() -> None:
    """Those of what is compiled while something else is being compiled."""
    cast(Any, JITCodeLibrary).is_inner = False
    one = cast(Any, CompilerBase)
    compile_it, depth = one._compile_core, 0

    def compile_marked(self: Any) -> Any:
        nonlocal depth
        state = self.state
        if depth > 0:
            if state.library is None:
                state.library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
                state.library.enable_object_caching()
            state.library.is_inner = True
        depth += 1
        try:
            return compile_it(self)
        finally:
            depth -= 1

    one._compile_core = compile_marked


def _leave_out_code() -> None:
    library, context = cast(Any, JITCodeLibrary), cast(Any, CPUContext)
    optimise, finish = library._optimize_final_module, library._finalize_final_module
    make_callable = context.get_executable

    def optimise_outer(self: Any) -> None:
        if not self.is_inner:
            optimise(self)

    def finish_outer(self: Any) -> None:
        if not self.is_inner:
            finish(self)
            return
        self._finalize_dynamic_globals()
        self._finalized = True

    def make_outer_callable(self: Any, library: Any, description: Any, environment: Any) -> Any:
        return description if library.is_inner else make_callable(self, library, description, environment)

    library._optimize_final_module, library._finalize_final_module = optimise_outer, finish_outer
    context.get_executable = make_outer_callable


def _leave_out_entries() -> None:
    context, dispatcher = cast(Any, CPUContext), cast(Any, Dispatcher)
    make_entry, add, compile_for = context.create_cpython_wrapper, dispatcher.add_overload, dispatcher._compile_for_args

    def make_outer_entry(self: Any, library: Any, *rest: Any, **named: Any) -> None:
        if not library.is_inner:
            make_entry(self, library, *rest, **named)

    def add_without_entry(self: Any, result: Any) -> None:
        if result.library.is_inner:
            self.overloads[tuple(result.signature.args)] = result
        else:
            add(self, result)

    def compile_for_python(self: Any, *values: Any, **named: Any) -> Any:
        with cast(Any, global_compiler_lock):  # another thread may be putting it into a caller
            kinds = tuple(self.typeof_pyval(value) for value in values)
            if kinds in self.overloads and self.overloads[kinds].library.is_inner:
                del self.overloads[kinds]
            return compile_for(self, *values, **named)

    context.create_cpython_wrapper = make_outer_entry
    dispatcher.add_overload, dispatcher._compile_for_args = add_without_entry, compile_for_python
