"""What the reference says of a class whose arguments and attributes are declared in calls."""

from ast import literal_eval
from typing import Any

from griffe import Attribute, Class, Docstring, ExprCall, Extension, Function, Parameters


class Signatures(Extension):
    """``@takes(options)`` gives a constructor these options; an attribute has the text of its declaration."""

    def on_class(self, *, cls: Class, loader: Any, **_: Any) -> None:
        for member in cls.members.values():
            if isinstance(member, Function) and member.name == "__init__":
                for made in (decorator.value for decorator in member.decorators):
                    if isinstance(made, ExprCall) and made.function.name == "takes":
                        options = loader.modules_collection[made.arguments[0].canonical_path]
                        member.parameters = Parameters(member.parameters[0], *options.parameters)
            elif isinstance(member, Attribute) and isinstance(member.value, ExprCall):
                texts = [str(one) for one in member.value.arguments[1:2]]
                if texts and texts[0][:1] in "'\"" and not member.docstring:
                    member.docstring = Docstring(literal_eval(texts[0]), parent=member)
