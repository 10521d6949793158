"""Records for tests of the kernel; its helpers take the rooms of one, ``helper(K)``, and write into them."""

from ftqp.kernel.entry.session import rooms
from ftqp.kernel.layout.enums import JOINTS
from ftqp.kernel.layout.record import load_chain, record
from ftqp.kernel.rows.failed_joints import sort_joints

SMALL = 8
"""The class of records that a test takes unless it needs more joints, so that helpers are compiled once."""


def empty_record(capacity=SMALL):
    """The rooms of a record that holds nothing; no joint would follow another one."""
    K = rooms(record(capacity))
    K.chain.lead[:], K.chain.ratio[:] = range(len(K.chain.lead)), 1.0
    return K


def chain_record(robot):
    """The rooms of a record that holds the robot's chain, all of whose joints work."""
    K = empty_record(JOINTS)
    load_chain(K, **robot.chain.constants())
    believe(K)
    return K


def believe(K, codes=None):
    """Fault codes by joint, and the list of joints that follows from them."""
    for joint, code in (codes or {}).items():
        K.faults.code[joint] = code
    sort_joints(K.faults, K.chain)


def formula(function):
    """A helper of the kernel as it is written, so that nothing is compiled for a test of a few numbers."""
    return getattr(function, "py_func", function)
